#include "app/import/config_text.h"

#include <fmt/format.h>

#include "core/utf8.h"

namespace trn {

std::string toml_number(double value) {
  std::string text = fmt::format("{:.12g}", value == 0 ? 0.0 : value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string plain_text(const std::string& text) {
  std::string out = text;
  const bool legal = !find_encoding_flaw(text);
  for (char& c : out) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) c = ' ';
    if (byte >= 0x80 && !legal) c = '?';
  }
  return out;
}

std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : plain_text(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace trn
