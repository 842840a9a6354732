#pragma once

#include <nlohmann/json.hpp>

#include "app/cli/config_keys.h"

namespace trn {

/// JSON schema (draft 7) of the config of a machine, for editors that complete and check as one types.
nlohmann::ordered_json config_schema(const ConfigKeys& keys);

}  // namespace trn
