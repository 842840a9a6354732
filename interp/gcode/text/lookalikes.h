#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

// Programs are copied from documents, and typed with a keyboard that is set to another alphabet. What comes
// of it looks right on the screen: a long dash for the minus, a Cyrillic letter for X.
namespace trn {

/// A character that looks like one of G-code, and is none.
struct Lookalike {
  std::uint32_t code_point = 0;  ///< Unicode
  char meant = ' ';              ///< of ASCII
};

/// What the first character of a text (UTF-8, or Windows-1252) looks like; nothing if it is ASCII or looks
/// like nothing that a program has.
std::optional<Lookalike> lookalike(std::string_view text);

}  // namespace trn
