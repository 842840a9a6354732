#pragma once

#include <memory>

#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Simulated inputs and outputs after the section [io] of the config: its own keys with `type` = "simulated",
/// those of [io.emulation] with `type` = "modbus". `kinematics` must outlive them. ConfigError as
/// ConfigTable.
std::unique_ptr<MachineIo> make_io(const Machine& machine, const ConfigTable& io,
                                   const Kinematics& kinematics);

}  // namespace trn
