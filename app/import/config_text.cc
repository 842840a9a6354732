#include "app/import/config_text.h"

#include <fmt/format.h>

namespace trn {

namespace {

/// How many bytes follow the first one of a character of UTF-8; 0: it begins none. Rare ranges count as none.
int bytes_behind(unsigned char first) {
  if (first >= 0xc2 && first < 0xe0) return 1;
  if (first >= 0xe1 && first < 0xed) return 2;
  return first >= 0xf1 && first < 0xf4 ? 3 : 0;
}

bool is_utf8(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x80) continue;
    const int more = bytes_behind(c);
    if (more == 0) return false;
    for (int k = 0; k < more; ++k)
      if (++i >= text.size() || (static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) return false;
  }
  return true;
}

}  // namespace

std::string toml_number(double value) {
  std::string text = fmt::format("{:.12g}", value == 0 ? 0.0 : value);
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string plain_text(const std::string& text) {
  std::string out = text;
  const bool legal = is_utf8(text);
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
