#pragma once

#include <memory>

#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Serial machine as data: [[kinematics.tool_branch]] and [[kinematics.work_branch]], each from the machine
/// base outwards, with `joint` (absent: a fixed offset), `direction`, `offset_mm` from the axis before it,
/// `sense` (+1; -1 for a primed axis of ISO 841: joint = sense * word) and `word` (default: the joint's
/// name), or `tilt_deg` instead of a joint. The spindle's axis is Z of the machine frame with every joint and
/// every tilt at zero. Up to two rotary and three
/// linear joints have a closed form; any other chain a bounded damped Newton.
std::unique_ptr<Kinematics> make_serial(const Machine& machine, const ConfigTable& section);

}  // namespace trn
