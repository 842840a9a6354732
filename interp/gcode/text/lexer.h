#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "core/letter_case.h"

namespace trn {

inline constexpr double kPowersOfTen[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                          1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
/// A decimal of at most 15 digits.
struct ShortDecimal {
  int length = 0;  ///< bytes of it; 0: there is none
  int decimals = 0;
  std::uint64_t digits = 0;
};

/// Reads one line of G code: case and white space do not matter outside comments. Columns are 1-based bytes.
class Lexer {
 public:
  explicit Lexer(std::string_view line)
      : begin_(line.data()), p_(line.data()), end_(line.data() + line.size()) {}

  /// Next byte that is not white space, lower case; 0 at the end of the line.
  char peek() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t')) ++p_;
    return p_ == end_ ? '\0' : lower_case(*p_);
  }
  void skip() { ++p_; }
  bool accept(char c) {
    if (peek() != c) return false;
    ++p_;
    return true;
  }
  /// Consumes `word` (lower case) if it comes next, white space between its letters ignored.
  bool accept_word(std::string_view word);

  /// A number without exponent; BlockError kBadNumber. Signs are read here.
  double number();
  /// The usual number, a sign and up to 15 digits in one piece, quickly; false, and nothing is consumed, for
  /// any other.
  bool short_number(double& value);
  /// An unsigned integer.
  std::int64_t integer();
  /// Text up to `close` (consumed), lower case and without white space; BlockError kMissingBracket.
  std::string name(char close);
  /// Raw text of a comment after its '('; BlockError if it does not end or nests.
  std::string_view comment();
  std::string_view rest() const { return {p_, static_cast<std::size_t>(end_ - p_)}; }
  void to_end() { p_ = end_; }

  std::uint32_t column() const { return static_cast<std::uint32_t>(p_ - begin_) + 1; }
  const char* mark() const { return p_; }
  void back_to(const char* mark) { p_ = mark; }

  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t'; }
  ShortDecimal decimal(const char* p) const;
  double spaced_number(const char* start, bool negative);

  const char* begin_;
  const char* p_;
  const char* end_;
};

/// The decimal at p, if it ends within the eight bytes that must be there.
// The bytes that are no digits have their top bit set in `other`; a first one that is the point is left out,
// and three multiplications put the digits before and behind it together (Lemire, "Quickly parsing eight
// digits", 2018).
inline ShortDecimal within_eight_bytes(const char* p) {
  constexpr int kBytes = 8;
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, p, kBytes);
  bytes ^= 0x3030303030303030U;
  const std::uint64_t other =
      (((bytes & 0x7F7F7F7F7F7F7F7FU) + 0x7676767676767676U) | bytes) & 0x8080808080808080U;
  const int first = std::countr_zero(other) / kBytes;
  int stop = first, count = first;
  if (first < kBytes && p[first] == '.') {
    const std::uint64_t before = (std::uint64_t{1} << (kBytes * first)) - 1;
    bytes = (bytes & before) | (bytes >> kBytes & ~before);
    stop = std::countr_zero(other & (other - 1)) / kBytes;
    count = stop - 1;
  }
  if (count == 0 || stop == kBytes) return {};
  bytes <<= kBytes * (kBytes - count);
  const std::uint64_t pairs = bytes * 10 + (bytes >> kBytes);
  const std::uint64_t all =
      (pairs & 0xFF000000FFU) * 0xF424000000064U + (pairs >> 16 & 0xFF000000FFU) * 0x271000000001U;
  return {stop, count - first, all >> 32};
}

// All digits fit exactly into a double, so that one division rounds right (Clinger 1990).
inline bool Lexer::short_number(double& value) {
  const char* p = p_;
  while (p != end_ && is_space(*p)) ++p;
  const bool negative = p != end_ && *p == '-';
  if (p != end_ && (*p == '-' || *p == '+')) ++p;
  ShortDecimal number;
  if (std::endian::native == std::endian::little && end_ - p >= 8) number = within_eight_bytes(p);
  if (number.length == 0) number = decimal(p);
  if (number.length == 0) return false;
  p += number.length;
  while (p != end_ && is_space(*p)) ++p;
  if (p != end_ && (is_digit(*p) || *p == '.')) return false;  // goes on behind white space
  const double magnitude =
      static_cast<double>(static_cast<std::int64_t>(number.digits)) / kPowersOfTen[number.decimals];
  value = negative ? -magnitude : magnitude;
  p_ = p;
  return true;
}

/// How a byte is shown in messages: itself, or its hexadecimal value.
std::string show_byte(char c);

}  // namespace trn
