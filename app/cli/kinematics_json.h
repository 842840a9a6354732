#pragma once

#include <nlohmann/json.hpp>

#include "core/machine.h"

namespace trn {

/// What the operator's page draws the machine of: its chain of axes, legs or rails, from the config's section
/// [kinematics]; mm. Of a serial machine both branches, from the base outwards. ConfigError as its reader.
nlohmann::json kinematics_json(const Machine& machine);

}  // namespace trn
