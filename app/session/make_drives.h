#pragma once

#include <memory>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Whether drives on a field bus are the real ones, or emulated ones on a bus in memory.
enum class Field { kReal, kEmulated };

/// The drives that section [drives] of the config asks for: `type` = "loopback", "simulated", "micro_mill" or
/// "canopen".
/// ConfigError as ConfigTable.
std::unique_ptr<Drives> make_drives(const Machine& machine, Field field = Field::kEmulated);

}  // namespace trn
