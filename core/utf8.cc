#include "core/utf8.h"

#include <fmt/format.h>

namespace trn {

namespace {

// Bytes of the character at the front of `text`; 0 if there is none in UTF-8.
std::size_t character_bytes(std::string_view text) {
  const auto at = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto follows = [&](std::size_t i) { return (at(i) & 0xC0) == 0x80; };
  const unsigned first = at(0), second = at(1);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    if ((first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F)) return 0;
    return follows(1) && follows(2) ? 3 : 0;
  }
  if (first < 0xF0 || first > 0xF4) return 0;
  if ((first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F)) return 0;
  return follows(1) && follows(2) && follows(3) ? 4 : 0;
}

}  // namespace

std::optional<TextFlaw> find_encoding_flaw(std::string_view text) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    return TextFlaw{1, 1, "this text is UTF-16; save the file as UTF-8"};
  TextFlaw place;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = character_bytes(text.substr(at));
    if (bytes == 0) {
      place.why = fmt::format("the byte 0x{:02x} is no UTF-8; save the file as UTF-8",
                              static_cast<unsigned char>(text[at]));
      return place;
    }
    const bool ends = text[at] == '\n';
    place.line += ends;
    place.column = ends ? 1 : place.column + 1;
    at += bytes;
  }
  return std::nullopt;
}

std::string_view first_letters(std::string_view text, std::size_t bytes_max) {
  if (text.size() <= bytes_max) return text;
  // The first byte that goes; behind its first byte a letter has up to three of the form 0b10xxxxxx.
  std::size_t end = bytes_max;
  for (int back = 0; back < 3 && end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80; ++back)
    --end;
  return text.substr(0, end);
}

}  // namespace trn
