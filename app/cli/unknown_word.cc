#include "app/cli/unknown_word.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>

#include "app/cli/help_formatter.h"
#include "app/cli/meant_command.h"
#include "app/cli/named_files.h"
#include "app/cli/topics.h"
#include "core/config.h"

namespace trn {

namespace {

std::string name_of(const CLI::App& app) {
  return app.get_parent() ? name_of(*app.get_parent()) + " " + app.get_name() : app.get_name();
}

// The one that begins so, or the nearest. A slip in every third letter: a command that was not meant can move
// a machine, so "move" is not near to "home", and "stat" is "status" and not "start".
std::string near_text(const std::string& word, const std::vector<std::string>& legal) {
  const auto begins = [&](const std::string& name) { return word.size() > 1 && name.starts_with(word); };
  const auto first = std::find_if(legal.begin(), legal.end(), begins);
  const bool only = first != legal.end() && std::none_of(first + 1, legal.end(), begins);
  const std::string near =
      only ? *first : nearest_word(word, legal, std::max<std::size_t>(1, word.size() / 3));
  return near.empty() ? ";" : fmt::format("; did you mean '{}'?", near);
}

// `words` begin with the one that is none.
std::string no_command(const CLI::App& app, const std::vector<std::string>& words) {
  const std::string& word = words.front();
  std::vector<std::string> legal;
  for (const CLI::App* command : shown_commands(app)) legal.push_back(command->get_name());
  if (!app.get_parent()) {
    if (const std::string meant = meant_command(words); !meant.empty())
      return fmt::format("'{}' is no command; {}\n", word, meant);
    if (!topic_text(word).empty())
      return fmt::format("'{0}' is no command; 'trunnion help {0}' tells what it is\n", word);
    legal.push_back("help");
    return fmt::format("'{}' is no command{} 'trunnion help' lists them all\n", word, near_text(word, legal));
  }
  return fmt::format("'{}' is no command of '{}'{} 'trunnion help {}' lists them\n", word, name_of(app),
                     near_text(word, legal), app.get_name());
}

std::string no_option(const CLI::App& app, const std::string& word) {
  std::vector<std::string> legal;
  for (const CLI::Option* option : shown_options(app, false))
    for (const std::string& name : option->get_lnames()) legal.push_back("--" + name);
  return fmt::format("'{}' has no option '{}'{} '{} --help' lists them\n", name_of(app), word,
                     near_text(word, legal), name_of(app));
}

constexpr double kNoBound = 1e300;

bool begins_with_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return end != text.c_str();
}

// "percent: Value 500 not in range 0.000000 to 200.000000", and what else CLI11 says in its own way.
std::string in_plain_words(std::string text, bool above_zero) {
  const auto split = [&text](std::string_view at) {
    const std::size_t found = text.find(at);
    if (found == std::string::npos) return std::string();
    const std::string behind = text.substr(found + at.size());
    text.resize(found);
    return behind;
  };
  if (const std::string range = split(" not in range "); !range.empty()) {
    const double low = std::stod(range), high = std::stod(range.substr(range.find(" to ") + 4));
    std::string legal = high > kNoBound ? fmt::format("{:g} or more is legal", low)
                                        : fmt::format("{:g} to {:g} is legal", low, high);
    if (above_zero) legal = "more than 0 is legal";
    const std::size_t value = text.find(": Value ");
    if (value != std::string::npos && !begins_with_number(text.substr(value + 8)))
      return fmt::format("{}: '{}' is no number; {}", text.substr(0, value), text.substr(value + 8), legal);
    return fmt::format("{} is out of range; {}", CLI::detail::find_and_replace(text, ": Value ", ": "),
                       legal);
  }
  if (const std::string choices = split(" not in {"); !choices.empty())
    return fmt::format("{} is not legal; what is: {}", text,
                       CLI::detail::find_and_replace(choices.substr(0, choices.find('}')), ",", ", "));
  if (text.ends_with(" missing") && !split(": 1 required").empty()) return text + " needs a value";
  return text;
}

bool from_environment(const CLI::Option& option, const std::vector<std::string>& words) {
  if (option.get_envname().empty() || !std::getenv(option.get_envname().c_str())) return false;
  return std::none_of(words.begin(), words.end(), [&](const std::string& word) {
    return option.check_name(word.substr(0, word.find('=')));
  });
}

// The text begins with the option's name.
std::string wrong_value(const CLI::App& command, const std::string& text,
                        const std::vector<std::string>& words) {
  const CLI::Option* option = command.get_option_no_throw(text.substr(0, text.find(':')));
  const bool above_zero = option && option->get_type_name().find("POSITIVE") != std::string::npos;
  const std::string plain = in_plain_words(text, above_zero);
  if (!option || !from_environment(*option, words)) return plain;
  return fmt::format("{}\nThe environment variable {} gives this value", plain, option->get_envname());
}

bool is_number(const std::string& word) { return word.find_first_of("0123456789.") == 1; }

// The first word for which the command has neither an option nor an argument; "" if all have one.
std::string extra_word(const CLI::App& command, const std::vector<std::string>& words) {
  int room = 0;
  for (const CLI::Option* argument : shown_options(command, true)) {
    if (argument->get_items_expected_max() >= CLI::detail::expected_max_vector_size) return "";
    room += argument->get_items_expected_max();
  }
  const CLI::App* here = &command;
  while (here->get_parent()) here = here->get_parent();
  bool is_value = false;
  for (const std::string& word : words) {
    const CLI::App* const inner = here == &command ? nullptr : find_command(*here, {word});
    if (is_value) {
      is_value = false;
    } else if (word.size() > 1 && word[0] == '-' && !is_number(word)) {
      const CLI::Option* option = here->get_option_no_throw(word);
      is_value = option && takes_value(*option);
    } else if (inner) {
      here = inner;
    } else if (--room < 0) {
      return word;
    }
  }
  return "";
}

// What somebody meant who wrote one word more than the command takes; "" if nobody knows.
std::string meant_by_extra(const CLI::App& command, const std::string& word) {
  for (const char* name : {"--machine", "--check"}) {
    const CLI::Option* option = command.get_option_no_throw(name);
    if (option && option->empty() && (word.ends_with(".toml") || machine_of_name(word)))
      return fmt::format("; did you mean '{} {}'?", name, word);
  }
  if (command.get_name() == "start" && is_file(with_examples(word)))
    return fmt::format(
        "; 'trunnion load {}' gives the daemon this program, and then 'trunnion start' begins it", word);
  return "";
}

}  // namespace

const CLI::App* find_command(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* found = &app;
  for (const std::string& word : words) {
    const CLI::App* inner = nullptr;
    for (const CLI::App* command : shown_commands(*found))
      if (command->get_name() == word) inner = command;
    if (!inner) return nullptr;
    found = inner;
  }
  return found;
}

std::optional<std::string> unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* here = &app;
  bool is_value = false;
  for (auto at = words.begin(); at != words.end(); ++at) {
    const std::string& word = *at;
    if (is_value) {
      is_value = false;
    } else if (word.size() > 1 && word[0] == '-') {
      const std::string name = word.substr(0, word.find('='));
      const CLI::Option* option = here->get_option_no_throw(name);
      if (!option && !is_number(word)) return no_option(*here, name);
      is_value = option && takes_value(*option) && name == word;
    } else if (const CLI::App* inner = find_command(*here, {word})) {
      here = inner;
    } else if (!shown_commands(*here).empty()) {
      return no_command(*here, {at, words.end()});
    }
  }
  return std::nullopt;
}

const CLI::App& command_of(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* here = &app;
  for (const std::string& word : words)
    if (const CLI::App* inner = find_command(*here, {word})) here = inner;
  return *here;
}

std::string usage_text(const CLI::App& app, const CLI::ParseError& error,
                       const std::vector<std::string>& words) {
  if (const auto unknown = unknown_word(app, words)) return *unknown;
  const CLI::App& command = command_of(app, words);
  const std::string name = name_of(command);
  const std::string said = error.what();
  if (!shown_commands(command).empty() && said.find("subcommand") != std::string::npos)
    return fmt::format("'{}' needs a command\n\n{}", name, command.help(name.substr(0, name.rfind(' '))));
  const std::string extra = extra_word(command, words);
  const std::string meant = extra.empty() ? "" : meant_by_extra(command, extra);
  const bool is_extra = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  // A machine without its --machine is told as "--machine is required", too.
  const bool tells_extra = !extra.empty() && (!meant.empty() || is_extra);
  return fmt::format("{}\n'{} --help' explains this command\n",
                     tells_extra ? fmt::format("'{}' takes no '{}'{}", name, extra, meant)
                                 : wrong_value(command, said, words),
                     name);
}

}  // namespace trn
