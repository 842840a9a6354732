#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// What counts when a program goes on after a stop, instead of what its own lines up to there set (G10, M61):
/// the offsets, lengths and the tool in the spindle that the operator has set himself since it began. Also
/// how the program found what it may have changed: G92 and the work offset in force.
struct MeasuredValues {
  struct Number {
    double value = 0;
    std::uint64_t until_block = 0;  ///< the program's lines count again behind so many; 0: from its first on
    bool operator==(const Number&) const = default;
  };
  struct ToolRow {
    std::optional<Tool> tool;       ///< none: taken out of the table
    std::uint64_t until_block = 0;  ///< the same
    bool operator==(const ToolRow&) const = default;
  };
  std::map<int, Number> numbers;  ///< by the number of the parameter
  std::map<int, ToolRow> tools;   ///< by the number of the tool

  bool empty() const { return numbers.empty() && tools.empty(); }
  bool operator==(const MeasuredValues&) const = default;

  /// Of what was set at one moment; 0 also where nothing was.
  std::uint64_t until_block() const {
    if (!numbers.empty()) return numbers.begin()->second.until_block;
    return tools.empty() ? 0 : tools.begin()->second.until_block;
  }
  /// What was set later counts.
  void add(const MeasuredValues& later) {
    for (const auto& [number, value] : later.numbers) numbers[number] = value;
    for (const auto& [number, row] : later.tools) tools[number] = row;
  }
  void set_until(std::uint64_t block) {
    for (auto& [number, value] : numbers) value.until_block = block;
    for (auto& [number, row] : tools) row.until_block = block;
  }
};

/// Offsets, G28 and G30, and the tool in the spindle; not G92, which is the program's own.
constexpr bool is_measured(int parameter_number) {
  return (parameter_number >= parameter::kG28 && parameter_number < parameter::kG92Active) ||
         (parameter_number >= parameter::kFirstOffset && parameter_number <= parameter::kLastOffset) ||
         parameter_number == parameter::kTool;
}

/// As the tables have them before a program begins.
MeasuredValues found_by_program(const Parameters& parameters);

/// What of it is not as it was.
MeasuredValues changes_between(const Parameters& before, const ToolTable& tools_before, const Parameters& now,
                               const ToolTable& tools_now);

}  // namespace trn
