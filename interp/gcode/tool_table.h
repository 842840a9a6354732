#pragma once

#include <map>
#include <string>

#include "interp/gcode/canon.h"

namespace trn {

/// One tool; lengths mm, angles degrees.
struct Tool {
  int number = 0;
  int pocket = 0;
  int slot = 0;  ///< place in the table, from 1: what the canonical functions of a tool changer name
  AxisValues offset = AxisValues::Zero();  ///< gauge point to tip
  double diameter = 0;
  double front_deg = 0, back_deg = 0;
  int orientation = 0;
  std::string comment;

  bool operator==(const Tool&) const = default;
};

/// Tools by number, without T0, which is no tool; read from and written to LinuxCNC's .tbl form ("T1 P1 D6.0
/// Z+50.0 ;end mill").
class ToolTable {
 public:
  const Tool* find(int number) const;
  Tool& at_or_new(int number);
  const std::map<int, Tool>& tools() const { return tools_; }
  /// Where the tools come from, for messages; "" for a table that nobody has given.
  const std::string& name() const { return name_; }

  /// ProgramError "file:line:column: message" for a line that is not of this form. A headline of words may
  /// stand above the first tool, as in old tables.
  /// A length of 1 in the file is `unit_mm`.
  static ToolTable load(const std::string& path, double unit_mm = 1);
  static ToolTable parse(std::string_view text, const std::string& name, double unit_mm = 1);
  std::string to_text() const;
  void save(const std::string& path) const;

 private:
  std::map<int, Tool> tools_;
  std::string name_;
  int lines_ = 0;  ///< tools and T0, for the slots
};

}  // namespace trn
