#pragma once

#include <vector>

#include "core/machine.h"
#include "kernel/safety_inputs.h"

namespace trn {

/// The inputs of section [safety]; none without one. ConfigError with file, line and column.
std::vector<SafetyInputs::Input> read_safety_inputs(const Machine& machine);

}  // namespace trn
