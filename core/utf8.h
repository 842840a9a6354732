#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace trn {

/// A place in a text, counted from 1, and what is wrong there.
struct TextFlaw {
  std::size_t line = 1, column = 1;
  std::string why;
};

/// Where a text is no UTF-8 (Unicode 15, table 3-7); nothing if it is.
std::optional<TextFlaw> find_encoding_flaw(std::string_view text);

/// The beginning of a UTF-8 text that is at most so many bytes long, in whole letters.
std::string_view first_letters(std::string_view text, std::size_t bytes_max);

}  // namespace trn
