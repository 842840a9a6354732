#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernel/rt_messages.h"

namespace trn {

/// What the operator does, and when: seconds after the start of the program.
struct OperatorAction {
  double time_s = 0;
  RtCommand command;
};

/// Reads an operator's script, `text` of the file `name`, for `trunnion run --operator`: a line for each
/// action, `SECONDS ACTION [VALUE]`, in order of time; `#` begins a comment. Actions: hold, resume, stop,
/// override PERCENT, rapid PERCENT, spindle PERCENT, adaptive PERCENT, step on|off. ProgramError "file:line:
/// what".
std::vector<OperatorAction> parse_operator_script(std::string_view text, const std::string& name);
/// The same from the file itself; ProgramError if it cannot be read.
std::vector<OperatorAction> read_operator_script(const std::string& path);

}  // namespace trn
