#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/parameters.h"

namespace trn {

/// One tool; lengths mm, angles degrees.
struct Tool {
  int number = 0;
  int pocket = 0;
  int slot = 0;    ///< place in the table, from 1: what the canonical functions of a tool changer name
  MmWords offset;  ///< gauge point to tip
  double diameter = 0;
  double front_deg = 0, back_deg = 0;
  int orientation = 0;
  std::string comment;

  bool operator==(const Tool&) const = default;
};

/// A line of a table that was not read; line and column count from 1.
struct LeftOutLine {
  std::uint32_t line = 0, column = 0;
  std::string text = {}, why = {};
};

/// Tools by number, without T0, which is no tool; read from and written to LinuxCNC's .tbl form ("T1 P1 D6.0
/// Z+50.0 ;end mill").
class ToolTable {
 public:
  const Tool* find(int number) const;
  Tool& at_or_new(int number);
  /// False: there is none.
  bool remove(int number);
  const std::map<int, Tool>& tools() const { return tools_; }
  /// Where the tools come from, for messages; "" for a table that nobody has given.
  const std::string& name() const { return name_; }
  /// Counts what may have been changed since the table was read.
  std::uint64_t revision() const { return revision_; }

  /// ProgramError "file:line:column: message" for a line that is not of this form. A headline of words may
  /// stand above the first tool, as in old tables.
  /// A length of 1 in the file is `unit_mm`.
  static ToolTable load(const std::string& path, double unit_mm = 1);
  static ToolTable parse(std::string_view text, const std::string& name, double unit_mm = 1);
  /// The same for a table of another control: a line that is not of this form, or whose tool is there
  /// already, is left out, and `left_out` tells it.
  static ToolTable parse_readable(std::string_view text, const std::string& name, double unit_mm,
                                  std::vector<LeftOutLine>& left_out);
  std::string to_text() const;
  /// `old_text`, the content of a table's file, with this table's tools: lines whose tools are the same, and
  /// those that name none of them, stay as they are.
  std::string text_over(std::string_view old_text) const;

 private:
  const Tool* changed_tool(std::string_view line, std::set<int>& seen) const;
  static ToolTable parse_lines(std::string_view text, const std::string& name, double unit_mm,
                               const std::function<void(const LeftOutLine&)>& leave_out);
  /// BlockError for a line that is no tool, or one that is there already.
  void read_line(std::string_view line, double unit_mm);

  std::map<int, Tool> tools_;
  std::string name_;
  int lines_ = 0;  ///< tools and T0, for the slots
  std::uint64_t revision_ = 0;
};

/// A tool for people, with the table's remark: "tool 2 (8 mm ball)"; "no tool" for 0.
std::string tool_name(const ToolTable& tools, int number);

/// The tool in the spindle, as programs see it: #5400 to #5413. A length of 1 there is `unit_mm`.
void set_spindle_tool(Parameters& parameters, const ToolTable& tools, int number, double unit_mm);

}  // namespace trn
