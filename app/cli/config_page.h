#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/config_keys.h"

namespace trn {

/// The page docs/config.md, in Markdown.
std::string config_page(const ConfigKeys& keys);

/// The same for programs: {"tables": [{"table", "type", "array", "required", "keys": [{"key", "form", "unit",
/// "required", "one_of", "default", "min", "above", "max", "choices", "meaning"}]}]}; what does not apply is
/// left out, and what follows from other keys stands in words, as "default_in_words" and "legal_in_words".
/// "one_of": these keys are the same in units of linear and rotary joints, and the table's own one is
/// required.
nlohmann::ordered_json config_json(const ConfigKeys& keys);

}  // namespace trn
