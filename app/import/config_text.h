#pragma once

#include <string>

namespace trn {

/// A number as TOML has it, with a point, to 12 digits: what people write comes back as they wrote it.
std::string toml_number(double value);
/// A text in quotation marks, escaped.
std::string toml_text(const std::string& text);

/// `text` without control characters, and with '?' for bytes that are no UTF-8, as a comment of TOML may have
/// it.
std::string plain_text(const std::string& text);

}  // namespace trn
