#include "interp/gcode/measured_values.h"

#include <optional>

namespace trn {

MeasuredValues found_by_program(const Parameters& parameters) {
  MeasuredValues out;
  for (int n = parameter::kG92Active; n <= parameter::kSystem; ++n) out.numbers[n].value = parameters[n];
  return out;
}

MeasuredValues changes_between(const Parameters& before, const ToolTable& tools_before, const Parameters& now,
                               const ToolTable& tools_now) {
  MeasuredValues out;
  for (int n = parameter::kG28; n <= parameter::kTool; ++n)
    if (is_measured(n) && before[n] != now[n]) out.numbers[n].value = now[n];
  for (const auto& [number, tool] : tools_now.tools()) {
    const Tool* const was = tools_before.find(number);
    if (!was || !(*was == tool)) out.tools[number].tool = tool;
  }
  for (const auto& [number, tool] : tools_before.tools())
    if (!tools_now.find(number)) out.tools[number].tool = std::nullopt;
  return out;
}

}  // namespace trn
