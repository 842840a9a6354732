#pragma once

#include "core/axes.h"
#include "core/config.h"
#include "sim/servo_mechanism.h"

namespace trn {

/// Reads a `mechanism` table of a simulated joint; ConfigError as ConfigTable.
ServoMechanism::Config read_mechanism(const Joint& joint, double period_s, const ConfigTable& table);

/// What stands for a drive in torque mode whose config describes no mechanism: it reaches twice the joint's
/// acceleration with the rated force.
ServoMechanism::Config plain_mechanism(const Joint& joint, double period_s, double rated_force);

}  // namespace trn
