#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/client_session.h"
#include "app/cli/commands.h"
#include "app/client/message_json.h"
#include "core/axes.h"
#include "core/letter_case.h"
#include "core/units.h"
#include "hal/lcm_messages.h"

// Offsets and tools: shown from the daemon's tables, changed by the lines of G-code that a program would use,
// so that they are checked, kept on disk and replayed as those are.
namespace trn {

namespace {

using trunnion::command_t;
using trunnion::tables_t;

struct TableOptions {
  std::shared_ptr<ClientOptions> client = std::make_shared<ClientOptions>();
  std::string offset;
  std::vector<std::string> words;
  int tool = -1;
  std::optional<int> pocket;
  std::optional<std::string> remark;
  bool of_tool = false;
  bool deletes = false;
};

constexpr std::size_t kRemarkMax = 80;
constexpr std::array<std::string_view, 9> kOffsets = {"G54", "G55",   "G56",   "G57",  "G58",
                                                      "G59", "G59.1", "G59.2", "G59.3"};

// 1 to 9; 0: "", the one in force.
std::size_t offset_number(const std::string& name) {
  if (name.empty()) return 0;
  const auto found = std::find(kOffsets.begin(), kOffsets.end(), upper_case(name));
  if (found == kOffsets.end())
    throw CLI::ValidationError(
        "OFFSET", fmt::format("'{}' is no work offset; they are {}", name, fmt::join(kOffsets, ", ")));
  return static_cast<std::size_t>(found - kOffsets.begin()) + 1;
}

// Beyond these a value was mistyped; G-code has no exponents either.
std::string block_word(char letter, double value) {
  constexpr double kFar = 1e6, kFullTurn_deg = 360;
  const bool turns = letter == 'R';
  const double most = turns ? kFullTurn_deg : kFar;
  if (std::abs(value) > most)
    throw CLI::ValidationError("WORDS", fmt::format("{} {:g} is out of range: {:.0f} to {:.0f} is legal",
                                                    letter, value, -most, most));
  if (letter == 'D' && value < 0)
    throw CLI::ValidationError("WORDS",
                               fmt::format("D {:g} is no diameter: 0 or more is legal, as D 8", value));
  std::string text = fmt::format("{:.9f}", value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return fmt::format(" {}{}", letter, text);
}

struct TypedWord {
  char letter;
  double value;
};

// What is wrong is named: a letter, or what stands where its number should be.
[[noreturn]] void refuse_word(std::string_view from_letter, bool known, std::string_view letters) {
  const std::string_view word = from_letter.substr(0, from_letter.find(' '));
  const std::size_t next = from_letter.find_first_not_of(' ', 1);
  const std::string legal = fmt::format("give a letter of {} and a number, as in X 10 or X10", letters);
  if (!known) throw CLI::ValidationError("WORDS", fmt::format("'{}' is not understood; {}", word, legal));
  if (next == std::string_view::npos)
    throw CLI::ValidationError("WORDS", fmt::format("no number follows {}; {}", from_letter[0], legal));
  const std::string_view number = from_letter.substr(next, from_letter.find(' ', next) - next);
  throw CLI::ValidationError("WORDS",
                             fmt::format("'{}' behind {} is no number; {}", number, from_letter[0], legal));
}

// "X" "10" "y-3": X is 10, Y is -3.
std::vector<TypedWord> words_of(const std::vector<std::string>& given, std::string_view letters) {
  std::string all;
  for (const std::string& word : given) all += word + " ";
  std::vector<TypedWord> out;
  for (std::size_t i = 0; i < all.size();) {
    if (all[i] == ' ') {
      ++i;
      continue;
    }
    const char letter = upper_case(all[i]);
    const bool known = letters.find(letter) != std::string_view::npos;
    std::size_t used = 0;
    double value = 0;
    try {
      value = std::stod(all.substr(i + 1), &used);
    } catch (const std::exception&) {
      used = 0;
    }
    if (!known || used == 0 || !std::isfinite(value))
      refuse_word(std::string_view(all).substr(i), known, letters);
    out.push_back({letter, value});
    i += 1 + used;
  }
  return out;
}

// As words of a block: "X10 Y-3". `letters`: those that may stand there.
std::string block_words(const std::vector<std::string>& given, std::string_view letters) {
  std::string out;
  for (const auto& [letter, value] : words_of(given, letters)) out += block_word(letter, value);
  return out;
}

// "X 76.2000 mm (3 inch), A 30 degrees": in the unit that the machine keeps, since what was typed counts in
// that which is in force.
std::string stored_text(const std::vector<TypedWord>& words, const trunnion::status_t& status) {
  const bool diameter = (" " + status.codes + " ").find(" G7 ") != std::string::npos;
  std::string out;
  for (const auto& [letter, value] : words) {
    const bool length = std::string_view("XYZD").find(letter) != std::string_view::npos;
    const bool radius = diameter && letter == 'X';
    if (!out.empty()) out += ", ";
    if (!length) {
      out += fmt::format("{} {:g} degrees", letter, value);
      continue;
    }
    out += fmt::format("{} {:.4f} mm", letter, value * (status.inch ? kMmPerInch : 1) / (radius ? 2 : 1));
    if (status.inch || radius)
      out +=
          fmt::format(" ({:g}{}{})", value, status.inch ? " inch" : " mm", radius ? " of diameter, G7" : "");
  }
  return out;
}

// `what` was set to these words.
void tell_stored(ClientSession& session, const TableOptions& options, const std::string& what,
                 std::string_view letters) {
  const trunnion::status_t* status = session.client.last_status();
  const std::vector<TypedWord> words = words_of(options.words, letters);
  if (status && !words.empty()) fmt::print("{}: {}\n", what, stored_text(words, *status));
}

// The work offset that a command names, or the one in force.
std::string named_offset(ClientSession& session, const TableOptions& options) {
  if (!options.offset.empty()) return upper_case(options.offset);
  const trunnion::status_t* status = session.client.last_status();
  return status ? status->work_offset : "";
}

// `typed`: what the operator knows it by.
Exit run_line(ClientSession& session, const TableOptions& options, const std::string& line,
              const std::string& typed) {
  ClientOptions waiting = *options.client;
  waiting.wait = true;
  return send(session, waiting, text_command(command_t::MDI, line), typed);
}

std::string cells(const double (&values)[6], bool all) {
  std::string text;
  for (int i = 0; i < 6; ++i)
    if (all || i < 3) text += fmt::format("{:>12.4f}", i < 3 ? values[i] : values[i] * kDegPerRad);
  return text;
}

void print_head(const char* first) {
  fmt::print("{}", first);
  for (const char letter : std::string_view(kWordLetters)) fmt::print("{:>12}", letter);
}

// Over a table, since what is typed may count in another unit.
void print_unit(std::string_view unit, bool inch) {
  fmt::print("in {}{}\n", unit,
             inch ? "; but inch is in force (G20), and values that you type count in inch" : "");
}

void print_offsets(const tables_t& t, const std::string& in_force, bool inch) {
  print_unit("mm and degrees", inch);
  print_head("       ");
  fmt::print("{:>10}\n", "rotation");
  for (std::size_t i = 0; i < t.offset_name.size(); ++i) {
    const double row[] = {t.offset_x[i], t.offset_y[i], t.offset_z[i],
                          t.offset_a[i], t.offset_b[i], t.offset_c[i]};
    fmt::print("{} {:<5}{}{:>10g}\n", t.offset_name[i] == in_force ? '>' : ' ', t.offset_name[i],
               cells(row, true), t.offset_rotation[i] * kDegPerRad);
  }
  fmt::print("> is in force\n");
}

// `only`: one of them; below 0: all.
void print_tools(const tables_t& t, int in_spindle, int only, bool inch) {
  if (t.tool_number.empty())
    return fmt::print("the machine has no tool table (trunnion daemon --tools FILE)\n");
  print_unit("mm", inch);
  fmt::print("    tool pocket    diameter           X           Y           Z  remark\n");
  for (std::size_t i = 0; i < t.tool_number.size(); ++i) {
    if (only >= 0 && t.tool_number[i] != only) continue;
    const double row[] = {t.tool_x[i], t.tool_y[i], t.tool_z[i], t.tool_a[i], t.tool_b[i], t.tool_c[i]};
    fmt::print("{} {:>6} {:>6}{:>12.4f}{}  {}\n", t.tool_number[i] == in_spindle ? '>' : ' ',
               t.tool_number[i], t.tool_pocket[i], t.tool_diameter[i], cells(row, false), t.tool_remark[i]);
  }
  if (t.tools_more > 0 && only < 0) fmt::print("and {} more\n", t.tools_more);
  fmt::print("> is in the spindle\n");
}

Exit show(const TableOptions& options, bool tools) {
  ClientSession session(*options.client);
  const tables_t tables = session.client.tables();
  const auto& numbers = tables.tool_number;
  const bool known = std::find(numbers.begin(), numbers.end(), options.tool) != numbers.end();
  if (tools && options.tool >= 0 && !known && tables.tools_more == 0) {
    fmt::print(stderr, "there is no tool {} in the table; it has: {}\n", options.tool,
               numbers.empty() ? "none" : fmt::format("{}", fmt::join(numbers, ", ")));
    return Exit::kUsage;
  }
  if (options.client->json) {
    fmt::print("{}\n", one_line(json_of(tables)));
    return Exit::kDone;
  }
  const auto status =
      session.client.wait_status([](const trunnion::status_t&) { return true; }, options.client->timeout_s);
  if (tools)
    print_tools(tables, status ? status->tool : 0, options.tool, status && status->inch);
  else
    print_offsets(tables, status ? status->work_offset : "", status && status->inch);
  return Exit::kDone;
}

Exit offset(const TableOptions& options) {
  if (options.words.empty() && options.offset.empty()) return show(options, false);
  const std::size_t number = offset_number(options.offset);
  if (options.words.empty())
    throw CLI::ValidationError("WORDS", "say what it shall be, as in: trunnion offset G55 X 10");
  const std::string words = block_words(options.words, "XYZABCR");
  ClientSession session(*options.client);
  const Exit exit = run_line(session, options, fmt::format("G10 L2 P{}{}", number, words), "offset");
  if (exit == Exit::kDone) tell_stored(session, options, named_offset(session, options), "XYZABCR");
  return exit;
}

Exit touch_off(const TableOptions& options) {
  const std::string words = block_words(options.words, "XYZABC");
  const std::size_t number = offset_number(options.offset);
  ClientSession session(*options.client);
  if (!options.of_tool) {
    const Exit exit = run_line(session, options, fmt::format("G10 L20 P{}{}", number, words), "touch-off");
    if (exit == Exit::kDone)
      tell_stored(session, options, "here, in " + named_offset(session, options), "XYZABC");
    return exit;
  }
  const auto status =
      session.client.wait_status([](const trunnion::status_t&) { return true; }, options.client->timeout_s);
  if (!status || status->tool == 0) {
    fmt::print(stderr, "no tool is in the spindle; say which one it is: trunnion tool NUMBER --in-spindle\n");
    return Exit::kUsage;
  }
  const int tool = status->tool;
  const Exit exit = run_line(session, options, fmt::format("G10 L10 P{}{}\nG43", tool, words), "touch-off");
  if (exit == Exit::kDone) tell_stored(session, options, fmt::format("here, with tool {}", tool), "XYZABC");
  return exit;
}

// What the table has is told, so that a number that was mistyped is seen.
Exit set_tool(const TableOptions& options, std::string words) {
  ClientSession session(*options.client);
  const tables_t tables = session.client.tables();
  const auto row = std::find(tables.tool_number.begin(), tables.tool_number.end(), options.tool);
  const bool adds = row == tables.tool_number.end();
  if (words.empty() && !adds) {  // the remark alone: a line of G10 sets something
    const auto i = static_cast<std::size_t>(row - tables.tool_number.begin());
    words = fmt::format(" H{}", tables.tool_pocket[i]);
  }
  if (options.remark) words += fmt::format(" ({})", options.remark->empty() ? " " : *options.remark);
  const Exit exit = run_line(session, options, fmt::format("G10 L1 P{}{}", options.tool, words), "tool");
  if (exit == Exit::kDone) tell_stored(session, options, fmt::format("tool {}", options.tool), "XYZABCD");
  if (exit == Exit::kDone && adds && !tables.tool_number.empty())
    fmt::print("tool {} is new in the table, which also has {}\n", options.tool,
               fmt::join(tables.tool_number, ", "));
  return exit;
}

std::string check_remark(const std::string& text) {
  const std::size_t bad = text.find_first_of("()\n\r");
  if (bad == std::string::npos && text.size() <= kRemarkMax) return "";
  if (bad == std::string::npos)
    return fmt::format("{} bytes are too many; at most {} are legal", text.size(), kRemarkMax);
  return "a remark is one line without parentheses";
}

// CLI11 would tell the largest double.
std::string check_tool_number(const std::string& text) {
  const bool digits =
      !text.empty() && text.size() <= 8 && text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? ""
                : fmt::format("'{}' is no tool number; a whole number from 0 to 99999999 is legal", text);
}

Exit tool(const TableOptions& options) {
  if (options.deletes) {
    ClientSession session(*options.client);
    command_t command = command_of(command_t::DELETE_TOOL);
    command.value = options.tool;
    return send(session, *options.client, command);
  }
  if (options.of_tool) {
    ClientSession session(*options.client);
    return run_line(session, options, fmt::format("M61 Q{}", options.tool), "tool");
  }
  const bool sets = !options.words.empty() || options.pocket || options.remark;
  if (!sets) return show(options, true);
  std::string words = block_words(options.words, "XYZABCD");
  // A table is made of diameters, G10 of radii.
  if (const std::size_t d = words.find('D'); d != std::string::npos) {
    std::size_t used = 0;
    const double diameter = std::stod(words.substr(d + 1), &used);
    words.replace(d, used + 1, fmt::format("R{:.9f}", diameter / 2));
  }
  if (options.pocket) words += fmt::format(" H{}", *options.pocket);
  return set_tool(options, words);
}

}  // namespace

void add_tables(CLI::App& app, Exit& exit) {
  const auto of_offset = std::make_shared<TableOptions>();
  CLI::App& offset_app = add_client(app, exit, of_offset->client, "offset",
                                    "Show the work offsets, or set one: trunnion offset G55 X 10 Y -5 R 30",
                                    [of_offset](const ClientOptions&) { return offset(*of_offset); });
  offset_app.add_option("offset", of_offset->offset, "G54 to G59.3");
  offset_app
      .add_option("words", of_offset->words,
                  "Letters and values, in the unit in force; R turns it about Z; what is not named stays")
      ->allow_extra_args();
  offset_app.add_flag("--json", of_offset->client->json, "For programs: offsets and tools, mm and rad");

  const auto touch = std::make_shared<TableOptions>();
  CLI::App& touch_app =
      add_client(app, exit, touch->client, "touch-off",
                 "Say what the work position here shall be: 'trunnion touch-off X 0' makes this place X0",
                 [touch](const ClientOptions&) { return touch_off(*touch); });
  touch_app.add_option("words", touch->words, "Letters and values, in the unit in force")->required();
  touch_app.add_option("--offset", touch->offset, "G54 to G59.3 instead of the one in force");
  touch_app.add_flag("--tool", touch->of_tool,
                     "Change the length of the tool in the spindle instead of the offset, and use it (G43)");

  const auto of_tool = std::make_shared<TableOptions>();
  CLI::App& tool_app = add_client(app, exit, of_tool->client, "tool",
                                  "Show the tools, or set, add or delete one: trunnion tool 3 Z 50.2 D 8",
                                  [of_tool](const ClientOptions&) { return tool(*of_tool); });
  tool_app.add_option("number", of_tool->tool, "The tool's number; one that is not in the table is added")
      ->check(check_tool_number);
  tool_app.add_option(
      "words", of_tool->words,
      "Letters and values, as Z 50.2 D 8. Z is the length, from the gauge point to the tip; X, Y, A, B, C "
      "likewise; D is the diameter. In mm or inch, whichever is in force; what is not named stays");
  tool_app
      .add_option("--pocket", of_tool->pocket,
                  "Its place in the changer or rack; a new tool gets the pocket of its own number")
      ->needs("number")
      ->check(check_tool_number);
  tool_app
      .add_option("--remark", of_tool->remark,
                  "A name for it, as '8 mm ball'; M6 asks for the tool by number and name")
      ->needs("number")
      ->check(check_remark);
  tool_app.add_flag("--in-spindle", of_tool->of_tool, "This tool is in the spindle now (M61); 0: none is")
      ->needs("number");
  tool_app
      .add_flag(
          "--delete", of_tool->deletes,
          "Take this tool out of the table. Refused for the tool in the spindle, and for one that the loaded "
          "program needs")
      ->needs("number")
      ->excludes("words")
      ->excludes("--pocket")
      ->excludes("--remark")
      ->excludes("--in-spindle");
  tool_app.add_flag("--json", of_tool->client->json, "For programs: offsets and tools, mm and rad");
}

}  // namespace trn
