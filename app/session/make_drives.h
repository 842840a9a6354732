#pragma once

#include <memory>
#include <string>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Whether drives on a field bus are the real ones, or emulated ones on a bus in memory.
enum class Field { kReal, kEmulated };

/// `type` of section [drives]; ConfigError as ConfigTable.
std::string drives_type(const Machine& machine);

/// The drives that section [drives] of the config asks for: `type` = "loopback", "simulated", "micro_mill" or
/// "canopen".
/// ConfigError as ConfigTable.
std::unique_ptr<Drives> make_drives(const Machine& machine, Field field = Field::kEmulated);

}  // namespace trn
