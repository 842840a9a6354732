#pragma once

#include <memory>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// The inputs and outputs that the section [io] of the config asks for: `type` = "simulated". `kinematics`
/// must outlive them. ConfigError as ConfigTable.
std::unique_ptr<MachineIo> make_io(const Machine& machine, const ConfigTable& io,
                                   const Kinematics& kinematics);

}  // namespace trn
