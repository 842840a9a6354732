#pragma once

#include <memory>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// The drives that section [drives] of the config asks for: `type` = "loopback" or "simulated". ConfigError
/// as ConfigTable.
std::unique_ptr<Drives> make_drives(const Machine& machine);

}  // namespace trn
