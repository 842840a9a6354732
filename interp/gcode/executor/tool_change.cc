#include <array>
#include <utility>

#include "interp/gcode/canon.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"

// M6 in two halves: what comes before the tool is in the spindle, and what comes behind.
namespace trn {

namespace {
constexpr double kLastTool = 99999999;
}  // namespace

void Executor::tool_is_in(int number) {
  tool_wait_ = ToolWait::kNone;
  s_.current_tool = number;
  if (number != 0) spindle_slot_ = slot_of(number);
  set_spindle_tool(parts_.parameters, parts_.tools, number, parts_.config.parameter_unit_mm);
}

// As the parameters have it from the last program.
int Executor::spindle_tool() const {
  const double number = std::as_const(parts_.parameters)[parameter::kTool];
  return number > 0 && number <= kLastTool ? static_cast<int>(number) : 0;
}

// Inside the sub-program that changes tools, M6 is the operator's part of it.
void Executor::ask_for_tool(int number) {
  incoming_tool_ = number;
  const ToolConfirm confirm = in_tool_call_ ? ToolConfirm::kOperator : parts_.config.tool_confirm;
  if (confirm == ToolConfirm::kSubProgram) {
    // The sub-program has an M6 of its own, for the moment when the tool is exchanged. Without the mark it
    // would call itself.
    in_tool_call_ = true;
    tool_wait_ = ToolWait::kCall;
    return;
  }
  canon::ChangeTool change{number, slot_of(number)};
  if (confirm == ToolConfirm::kOperator) change.confirm = kToolByOperator;
  if (confirm == ToolConfirm::kInput) change.confirm = parts_.config.tool_input;
  put(change);
  // Nobody to ask, as in a check of the program: the tool is in at once.
  if (!parts_.asks || confirm == ToolConfirm::kNobody) return tool_is_in(number);
  questions_.push_back(Question::kTool);
  tool_wait_ = ToolWait::kAnswer;
}

std::array<double, 4> Executor::tool_call_arguments() const {
  const auto pocket = [&](int number) {
    const Tool* const tool = number == 0 ? nullptr : parts_.tools.find(number);
    return static_cast<double>(tool ? tool->pocket : 0);
  };
  return {static_cast<double>(incoming_tool_), static_cast<double>(s_.current_tool), pocket(incoming_tool_),
          pocket(s_.current_tool)};
}

void Executor::end_tool_call(int number) {
  in_tool_call_ = false;
  tool_is_in(number);
}

void Executor::forget_tool_change() {
  in_tool_call_ = false;
  tool_wait_ = ToolWait::kNone;
}

}  // namespace trn
