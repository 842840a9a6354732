#pragma once

#include <string>
#include <string_view>

namespace trn {

/// For a line `key = value` that TOML refuses: what was most likely meant, as a sentence; "" if nobody knows.
std::string explain_value(std::string_view line);

/// For a line that TOML refuses with this reason: a table's name in brackets that do not fit, a name that
/// stands there twice, a line that belongs to YAML or JSON. The same kind of sentence; "" if nobody knows.
std::string explain_structure(std::string_view line, std::string_view reason);

/// Whether two keys name one quantity in two units, as max_mm and max_inch.
bool same_quantity(std::string_view key, std::string_view other);

}  // namespace trn
