#include "interp/gcode/text/lookalikes.h"

#include <array>

namespace trn {

namespace {

// A group is what looks alike in order: the first of `meant` is at `first`, the next one at first + 1.
// '?' stands for one that looks like nothing here.
struct Group {
  std::uint32_t first;
  std::string_view meant;
};
constexpr std::array kGroups = {
    Group{0x00A0, " "},                        // a space that holds words together
    Group{0x00D7, "*"},                        // the sign of a product
    Group{0x0391, "AB??EZH?IK?MN?O?P??TY?X"},  // Greek, from alpha to chi
    Group{0x03BF, "o"},                        // omicron
    Group{0x0405, "S"},                        // Cyrillic, as in Serbian
    Group{0x0406, "I"},                        // as in Ukrainian
    Group{0x0408, "J"},                        // as in Serbian
    Group{0x0410, "A?B??E????K?MHO?PCTY?X"},   // from a to kha
    Group{0x0430, "a????e????????o?pc?y?x"},   // the small ones
    Group{0x2000, "            "},             // spaces of all widths, the last one of none
    Group{0x2010, "------"},                   // hyphens and dashes
    Group{0x202F, " "},
    Group{0x2212, "-"},  // the minus of mathematics
    Group{0x3000, " "},
    Group{0xFEFF, " "},  // the mark of a file's beginning, of no width
};

// Full-width forms of ASCII, as keyboards for Chinese and Japanese write them.
constexpr std::uint32_t kWideFirst = 0xFF01, kWideLast = 0xFF5E, kWideAhead = 0xFEE0;

// Of two or three bytes in UTF-8; other characters look like nothing here. A byte that begins no such
// character is one of Windows-1252.
std::uint32_t code_point(std::string_view text) {
  const auto byte = [&](std::size_t i) -> std::uint32_t {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
  };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xC0) == 0x80; };
  if ((byte(0) & 0xE0) == 0xC0 && follows(1)) return ((byte(0) & 0x1F) << 6) | (byte(1) & 0x3F);
  if ((byte(0) & 0xF0) == 0xE0 && follows(1) && follows(2))
    return ((byte(0) & 0x0F) << 12) | ((byte(1) & 0x3F) << 6) | (byte(2) & 0x3F);
  return byte(0) == 0x96 ? 0x2013 : byte(0) == 0x97 ? 0x2014 : byte(0);
}

}  // namespace

std::optional<Lookalike> lookalike(std::string_view text) {
  const std::uint32_t found = code_point(text);
  if (found >= kWideFirst && found <= kWideLast)
    return Lookalike{found, static_cast<char>(found - kWideAhead)};
  for (const Group& group : kGroups) {
    if (found < group.first || found - group.first >= group.meant.size()) continue;
    const char meant = group.meant[found - group.first];
    if (meant != '?') return Lookalike{found, meant};
  }
  return std::nullopt;
}

}  // namespace trn
