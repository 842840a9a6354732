#pragma once

#include <string>
#include <vector>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Figures of a config that are legal and hardly right, a sentence each: what stands there, what it would
/// mean, and what would be plausible. "file:line:column: " in front where a key is to blame.
std::vector<std::string> implausible(const Machine& machine, const Kinematics& kinematics);

}  // namespace trn
