#include "app/cli/help_formatter.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "core/letter_case.h"

namespace trn {

namespace {

constexpr std::size_t kColumnsMost = 100, kColumnsLeast = 20, kTextColumn = 32;

// As wide as COLUMNS says, which a shell or a person sets, but no wider than lines are good to read.
std::size_t columns() {
  const char* const given = std::getenv("COLUMNS");
  std::size_t wide = 0;
  if (given && std::from_chars(given, given + std::strlen(given), wide).ec == std::errc() && wide > 0)
    return std::clamp(wide, kColumnsLeast, kColumnsMost);
  return kColumnsMost;
}

// Where the meaning of an option begins: further left where there is little room.
std::size_t text_column() { return kTextColumn * columns() / kColumnsMost; }

struct Group {
  const char* name;
  std::vector<std::string_view> commands;
};

// In the order of the help. What stands in none is shown under "More", behind them.
const std::array kGroups = {
    Group{"Try a program on this computer", {"run", "interpret", "check-trace", "replay"}},
    Group{"Run a machine",
          {"daemon", "panel", "reset", "home", "jog", "wheel", "status", "monitor", "estop", "acknowledge"}},
    Group{"Cut a part",
          {"load", "start", "hold", "resume", "stop", "reverse", "forward", "override", "step", "switch",
           "mdi", "parts"}},
    Group{"Offsets, tools and corrections", {"offset", "touch-off", "tool", "correction", "sensor"}},
    Group{"Set up a machine",
          {"config", "import", "kin", "workspace", "io", "commission", "latency", "can", "modbus", "scope",
           "tune", "following"}},
    Group{"Make a machine accurate", {"ballbar", "ball", "joint-table", "micromill"}},
    Group{"Let other computers command and see", {"gateway", "key", "mqtt"}},
    Group{"This program", {"man", "completions"}},
};

// Where the help lists a command; the same for all that stand in no group.
std::size_t command_rank(const CLI::App& command) {
  std::size_t rank = 0;
  for (const Group& group : kGroups)
    for (const std::string_view name : group.commands)
      if (++rank; command.get_name() == name && command.get_group() == group.name) return rank;
  return rank + 1;
}

/// A name, and behind it or below it what it is.
std::string entry(const std::string& name, std::string_view text) {
  std::string out = "  " + name;
  if (text.empty()) return out + "\n";
  const std::size_t column = text_column();
  if (out.size() + 2 > column) out += "\n";
  const std::size_t last_line = out.size() - (out.rfind('\n') == std::string::npos ? 0 : out.rfind('\n') + 1);
  return out + std::string(column - last_line, ' ') + wrapped(text, column) + "\n";
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t column) {
  std::string out;
  const std::size_t most = columns();
  std::size_t at = column;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(" \n"), text.size());
    const std::string_view word = text.substr(0, end);
    if (at > column && at + 1 + word.size() > most) {
      out += "\n" + std::string(column, ' ');
      at = column;
    } else if (at > column) {
      out += ' ';
      ++at;
    }
    out += word;
    at += word.size();
    if (end < text.size() && text[end] == '\n') {
      out += "\n" + std::string(column, ' ');
      at = column;
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

void sort_into_groups(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) {
    command->group("More");
    for (const Group& group : kGroups)
      for (const std::string_view name : group.commands)
        if (command->get_name() == name) command->group(group.name);
  }
}

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  std::vector<const CLI::App*> commands = app.get_subcommands(
      [](const CLI::App* command) { return !command->get_name().empty() && !command->get_group().empty(); });
  std::stable_sort(commands.begin(), commands.end(),
                   [](const CLI::App* a, const CLI::App* b) { return command_rank(*a) < command_rank(*b); });
  return commands;
}

std::vector<const CLI::Option*> shown_options(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return option->get_positional() == positional && !option->get_group().empty();
  });
}

std::string full_text(const CLI::App& command) {
  const std::string text = command.get_description();
  const bool open = !text.empty() && std::isalpha(static_cast<unsigned char>(text.back())) != 0;
  return open && text.find('\n') == std::string::npos ? text + "." : text;
}

std::string first_sentence(const CLI::App& command) {
  std::string text = command.get_description();
  text.resize(std::min({text.find(". "), text.find('\n'), text.size()}));
  if (!text.empty() && text.back() == '.') text.pop_back();
  if (!text.empty()) text[0] = upper_case(text[0]);
  return text;
}

// A unit, a letter of an axis and a value stay as they are.
std::string option_text(const CLI::Option& option) {
  std::string text = option.get_description();
  const std::string word = text.substr(0, text.find(' '));
  const bool letters = std::all_of(word.begin(), word.end(), [](char c) { return c >= 'a' && c <= 'z'; });
  const bool unit = word == "mm" || word == "deg" || word == "rad" || word == "um" || word == "ms";
  const bool value = word.size() < 2 && word != "a";
  if (letters && !unit && !value) text[0] = upper_case(text[0]);
  return text;
}

std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.rfind('}');
  if (open == std::string::npos || close == std::string::npos) return {};
  return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

std::string value_name(const CLI::Option& option) {
  if (!takes_value(option)) return "";
  const std::vector<std::string> choices = choices_of(option);
  if (!choices.empty()) return CLI::detail::join(choices, "|");
  const std::string type = option.get_type_name();
  if (type == "TEXT:FILE") return "FILE";
  for (const char* const named : {"LINE", "MM", "SECONDS"})
    if (type.rfind(named, 0) == 0) return named;
  return type.rfind("TEXT", 0) == 0 ? type : "NUMBER";
}

std::string option_remarks(const CLI::Option& option) {
  std::vector<std::string> out;
  const std::string type = option.get_type_name();
  if (option.get_required()) out.push_back("required");
  if (option.get_positional() && !choices_of(option).empty()) out.push_back(value_name(option));
  if (type.find(":POSITIVE") != std::string::npos) out.push_back("above 0");
  if (const std::size_t open = type.find(" in ["); open != std::string::npos) {
    const std::string range = type.substr(open + 5, type.find(']', open) - open - 5);
    const std::size_t middle = range.find(" - ");
    // So great an end is there for the computer's sake.
    const bool endless = middle != std::string::npos && std::stod(range.substr(middle + 3)) >= 1e8;
    out.push_back(endless ? range.substr(0, middle) + " or more"
                          : CLI::detail::find_and_replace(range, " - ", " to "));
  }
  if (!option.get_default_str().empty()) out.push_back("default " + option.get_default_str());
  if (!option.get_envname().empty()) out.push_back("or the environment variable " + option.get_envname());
  for (const CLI::Option* other : option.get_excludes()) out.push_back("not with " + other->get_name());
  for (const CLI::Option* other : option.get_needs()) out.push_back("only with " + other->get_name());
  return out.empty() ? "" : " (" + CLI::detail::join(out, "; ") + ")";
}

HelpFormatter::HelpFormatter() {
  label("OPTIONS", "options");
  label("SUBCOMMAND", "COMMAND");
  label("Positionals", "Arguments");
}

// CLI11 lists them in the order in which they were made.
std::string HelpFormatter::make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const {
  std::string out, group;
  for (const CLI::App* command : shown_commands(*app)) {
    if (command->get_group() != group) out += "\n" + (group = command->get_group()) + ":\n";
    out += mode == CLI::AppFormatMode::All ? command->help(command->get_name(), CLI::AppFormatMode::Sub)
                                           : make_subcommand(command);
  }
  return out;
}

std::string HelpFormatter::make_subcommand(const CLI::App* sub) const {
  return entry(sub->get_name(), first_sentence(*sub));
}

std::string HelpFormatter::make_option(const CLI::Option* opt, bool is_positional) const {
  std::string name = opt->get_name(is_positional, !is_positional);
  const std::string value = is_positional ? "" : value_name(*opt);
  if (!value.empty()) name += " " + value;
  return entry(name, option_text(*opt) + option_remarks(*opt));
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return wrapped(full_text(*app), 0) + "\n\n";
}

}  // namespace trn
