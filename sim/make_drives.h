#pragma once

#include <memory>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// The drives that section [drives] of the config asks for: `type` = "loopback", "simulated" or "micro_mill".
/// ConfigError as ConfigTable.
std::unique_ptr<Drives> make_drives(const Machine& machine);

}  // namespace trn
