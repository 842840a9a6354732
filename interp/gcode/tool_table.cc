#include "interp/gcode/tool_table.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "interp/gcode/error.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/text/lexer.h"
#include "interp/move.h"

namespace trn {

namespace {

constexpr std::string_view kAxisLetters = "xyzabc";

int whole(double value, std::uint32_t column) {
  if (value != std::floor(value) || value < 0 || value > 99999999)
    fail(GcodeErrorCode::kNotInteger, column, "the tool or pocket number", value);
  return static_cast<int>(value);
}

void read_field(char letter, double value, std::uint32_t column, Tool& tool) {
  const std::size_t axis = kAxisLetters.find(letter);
  if (axis != std::string_view::npos) {
    tool.offset[static_cast<int>(axis)] = value;
    return;
  }
  switch (letter) {
    case 't':
      tool.number = whole(value, column);
      break;
    case 'p':
      tool.pocket = whole(value, column);
      break;
    case 'd':
      tool.diameter = value;
      break;
    case 'i':
      tool.front_deg = value;
      break;
    case 'j':
      tool.back_deg = value;
      break;
    case 'q':
      tool.orientation = whole(value, column);
      break;
    case 'u':
    case 'v':
    case 'w':
      break;  // offsets of axes no machine here has
    default:
      fail(GcodeErrorCode::kBadCharacter, column, show_byte(letter));
  }
}

// "POC FMS LEN DIAM COMMENT": words without a number, of a table of old.
bool is_headline(std::string_view line) {
  const std::string_view text = line.substr(0, line.find(';'));
  int letters = 0;
  for (const char c : text) {
    if (Lexer::is_digit(c)) return false;
    letters += Lexer::is_letter(c);
  }
  return letters > 1;
}

// False for an empty line.
bool read_tool(std::string_view line, Tool& tool) {
  Lexer lexer(line);
  bool any = false, numbered = false;
  for (char c = lexer.peek(); c != '\0' && c != ';'; c = lexer.peek()) {
    const std::uint32_t column = lexer.column();
    if (!Lexer::is_letter(c)) fail(GcodeErrorCode::kBadCharacter, column, show_byte(c));
    lexer.skip();
    const double value = lexer.number();
    read_field(c, value, column, tool);
    any = true;
    numbered |= c == 't';
  }
  if (lexer.accept(';')) tool.comment = std::string(lexer.rest());
  if (any && !numbered) fail(GcodeErrorCode::kMissingWord, 1, "a tool", "T and its number");
  return any;
}

// Six digits, as the form has it, or as many more as the value needs to be read again as it is.
std::string digits(double value) {
  const std::string text = fmt::format("{:+.6f}", value);
  if (std::strtod(text.c_str(), nullptr) == value) return text;
  std::string shortest(400, '+');  // the least double has 324 digits behind the point
  char* const first = shortest.data() + (value > 0 ? 1 : 0);
  char* const last = shortest.data() + shortest.size();
  const char* end = std::to_chars(first, last, value, std::chars_format::fixed).ptr;
  shortest.resize(static_cast<std::size_t>(end - shortest.data()));
  return shortest;
}

std::string line_of(const Tool& tool) {
  std::string text = fmt::format("T{} P{}", tool.number, tool.pocket);
  for (std::size_t i = 0; i < kAxisLetters.size(); ++i) {
    const double value = tool.offset[static_cast<int>(i)];
    if (value != 0) text += fmt::format(" {}{}", kWordLetters[i], digits(value));
  }
  if (tool.diameter != 0) text += " D" + digits(tool.diameter);
  if (tool.front_deg != 0) text += " I" + digits(tool.front_deg);
  if (tool.back_deg != 0) text += " J" + digits(tool.back_deg);
  if (tool.orientation != 0) text += fmt::format(" Q{}", tool.orientation);
  return tool.comment.empty() ? text : fmt::format("{} ;{}", text, tool.comment);
}

}  // namespace

const Tool* ToolTable::find(int number) const {
  const auto found = tools_.find(number);
  return found == tools_.end() ? nullptr : &found->second;
}

Tool& ToolTable::at_or_new(int number) {
  ++revision_;
  Tool& tool = tools_[number];
  if (tool.number == 0) tool.slot = ++lines_;
  tool.number = number;
  return tool;
}

bool ToolTable::remove(int number) {
  if (tools_.erase(number) == 0) return false;
  ++revision_;
  return true;
}

void ToolTable::read_line(std::string_view line, double unit_mm) {
  const std::size_t zero = line.find('\0');
  if (zero != std::string_view::npos) fail(GcodeErrorCode::kBinary, static_cast<std::uint32_t>(zero + 1), 0);
  Tool tool;
  if (lines_ == 0 && is_headline(line)) return;
  if (!read_tool(line, tool)) return;
  tool.slot = ++lines_;
  if (tool.number == 0) return;
  if (tools_.count(tool.number)) fail(GcodeErrorCode::kRepeatedWord, 1, fmt::format("T{}", tool.number));
  tool.offset.xyz *= unit_mm;
  tool.diameter *= unit_mm;
  tools_[tool.number] = tool;
}

ToolTable ToolTable::parse_lines(std::string_view text, const std::string& name, double unit_mm,
                                 const std::function<void(const LeftOutLine&)>& leave_out) {
  ToolTable table;
  table.name_ = name;
  std::istringstream stream{std::string(text)};
  std::string line;
  for (std::uint32_t number = 1; std::getline(stream, line); ++number) {
    while (!line.empty() && line.back() == '\r') line.pop_back();
    try {
      table.read_line(line, unit_mm);
    } catch (const BlockError& error) {
      // The form of the first columns, where somebody had another table or another file in mind.
      const bool none = table.lines_ == 0 && error.code == GcodeErrorCode::kBadNumber && error.column <= 2;
      const bool other_form = none || error.code == GcodeErrorCode::kBadCharacter;
      leave_out({number, error.column, line,
                 fmt::format("{}{}{}", error.what(), none ? "; this looks like no tool table" : "",
                             other_form ? "; a tool is a line as 'T1 P1 Z50.5 D6 ;end mill'" : "")});
    }
  }
  return table;
}

ToolTable ToolTable::parse(std::string_view text, const std::string& name, double unit_mm) {
  return parse_lines(text, name, unit_mm, [&](const LeftOutLine& at) {
    throw ProgramError(fmt::format("{}:{}:{}: {}", name, at.line, at.column, at.why));
  });
}

ToolTable ToolTable::parse_readable(std::string_view text, const std::string& name, double unit_mm,
                                    std::vector<LeftOutLine>& left_out) {
  return parse_lines(text, name, unit_mm, [&](const LeftOutLine& at) { left_out.push_back(at); });
}

ToolTable ToolTable::load(const std::string& path, double unit_mm) {
  return parse(read_text_file(path), path, unit_mm);
}

std::string ToolTable::to_text() const {
  std::string text;
  for (const auto& [number, tool] : tools_) text += line_of(tool) + "\n";
  return text;
}

std::string ToolTable::text_over(std::string_view old_text) const {
  std::string text;
  std::set<int> seen;
  std::string_view ending = "\n";
  while (!old_text.empty()) {
    const std::size_t end = std::min(old_text.find('\n'), old_text.size());
    std::string_view line = old_text.substr(0, end);
    old_text.remove_prefix(std::min(end + 1, old_text.size()));
    ending = line.ends_with('\r') ? "\r\n" : "\n";
    if (line.ends_with('\r')) line.remove_suffix(1);
    const Tool* tool = changed_tool(line, seen);
    text += tool ? line_of(*tool) : std::string(line);
    text += ending;
  }
  for (const auto& [number, tool] : tools_)
    if (!seen.contains(number)) text.append(line_of(tool)).append(ending);
  return text;
}

// The tool that this line of a file should have; null if it may stay.
const Tool* ToolTable::changed_tool(std::string_view line, std::set<int>& seen) const {
  Tool in_file;
  try {
    if (!read_tool(line, in_file)) return nullptr;
  } catch (const BlockError&) {  // somebody is editing the file: not ours to mend
    return nullptr;
  }
  const Tool* ours = find(in_file.number);
  if (!ours) return nullptr;
  seen.insert(ours->number);
  in_file.slot = ours->slot;
  return in_file == *ours ? nullptr : ours;
}

std::string tool_name(const ToolTable& tools, int number) {
  if (number == 0) return "no tool";
  const Tool* tool = tools.find(number);
  std::string remark = tool ? tool->comment : "";
  remark.erase(0, std::min(remark.size(), remark.find_first_not_of(" \t")));
  return remark.empty() ? fmt::format("tool {}", number) : fmt::format("tool {} ({})", number, remark);
}

void set_spindle_tool(Parameters& parameters, const ToolTable& tools, int number, double unit_mm) {
  const Tool* tool = tools.find(number);
  const Tool none;
  if (!tool) tool = &none;
  parameters[parameter::kTool] = number;
  const TableWords offset = in_table_units(tool->offset, unit_mm);
  for (int i = 0; i < 6; ++i) parameters[parameter::kToolOffset + i] = offset[i];
  parameters[parameter::kToolDiameter] = tool->diameter / unit_mm;
  parameters[parameter::kToolDiameter + 1] = tool->front_deg;
  parameters[parameter::kToolDiameter + 2] = tool->back_deg;
  parameters[parameter::kToolDiameter + 3] = tool->orientation;
}

}  // namespace trn
