#include "interp/gcode/text/lexer.h"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <array>

#include "interp/gcode/error.h"

namespace trn {

namespace {

constexpr double kNumberLimit = 1e15;  // longer ones have lost their last digit before the point

double parse_digits(const char* first, const char* last, std::uint32_t column, const char** stop) {
  double value = 0;
  const auto result = fast_float::from_chars(first, last, value, fast_float::chars_format::fixed);
  // Fixed notation only: in G-code an E behind a number is the next word and no exponent.
  if (result.ec != std::errc() || !(value < kNumberLimit)) fail(GcodeErrorCode::kBadNumber, column);
  *stop = result.ptr;
  return value;
}

}  // namespace

bool Lexer::accept_word(std::string_view word) {
  const char* start = p_;
  for (const char c : word) {
    // White space inside a word is passed over, as in "G O T O", so what was taken must be given back if the
    // word is another one.
    if (peek() != c) {
      p_ = start;
      return false;
    }
    ++p_;
  }
  return true;
}

ShortDecimal Lexer::decimal(const char* p) const {
  // A double holds every whole number of 15 digits, and one division by a power of ten rounds once: the
  // result is the nearest double, as the slow way would give it.
  constexpr int kExactDigits = 15;
  ShortDecimal found;
  int digits = 0;
  bool point = false;
  const char* const first = p;
  for (; p != end_; ++p) {
    if (is_digit(*p)) {
      found.digits = found.digits * 10 + static_cast<unsigned>(*p - '0');
      ++digits;
      found.decimals += point;
    } else if (*p == '.' && !point) {
      point = true;
    } else {
      break;
    }
  }
  if (digits > 0 && digits <= kExactDigits) found.length = static_cast<int>(p - first);
  return found;
}

double Lexer::number() {
  double usual = 0;
  if (short_number(usual)) return usual;
  bool negative = false;
  char c = peek();
  if (c == '+' || c == '-') {
    negative = c == '-';
    ++p_;
    c = peek();
  }
  if (!is_digit(c) && c != '.') fail(GcodeErrorCode::kBadNumber, column());
  const char* start = p_;
  const auto of_number = [](char byte) { return is_digit(byte) || byte == '.'; };
  // How far the number goes without white space; if more of it comes behind some, it is read anew in one
  // piece.
  while (p_ != end_ && of_number(*p_)) ++p_;
  // White space is allowed anywhere in RS274/NGC (section 3.3), numbers included.
  if (of_number(peek())) return spaced_number(start, negative);
  p_ = start;
  const std::uint32_t at = column();
  const double value = parse_digits(start, end_, at, &p_);
  if (of_number(peek())) fail(GcodeErrorCode::kBadNumber, at);  // a second point
  return negative ? -value : value;
}

// White space may lie inside a number ("12 34.5"); rare, so it is read a second time here.
double Lexer::spaced_number(const char* start, bool negative) {
  std::array<char, 64> digits;
  std::size_t count = 0;
  p_ = start;
  const std::uint32_t at = column();
  for (char c = peek(); is_digit(c) || c == '.'; c = peek()) {
    if (count == digits.size()) fail(GcodeErrorCode::kBadNumber, at);
    digits[count++] = c;
    ++p_;
  }
  const char* stop = nullptr;
  const double value = parse_digits(digits.data(), digits.data() + count, at, &stop);
  if (stop != digits.data() + count) fail(GcodeErrorCode::kBadNumber, at);
  return negative ? -value : value;
}

std::int64_t Lexer::integer() {
  std::int64_t value = 0;
  const std::uint32_t at = column();
  if (!is_digit(peek())) fail(GcodeErrorCode::kBadNumber, at);
  for (; is_digit(peek()); ++p_) {
    value = value * 10 + (*p_ - '0');
    if (value > 1'000'000'000'000) fail(GcodeErrorCode::kBadNumber, at);
  }
  return value;
}

std::string Lexer::name(char close) {
  std::string text;
  const std::uint32_t at = column();
  for (;;) {
    const char c = peek();
    if (c == '\0') fail(GcodeErrorCode::kMissingBracket, at, close);
    ++p_;
    if (c == close) break;
    text += c;
  }
  if (text.empty()) fail(GcodeErrorCode::kBadName, at);
  return text;
}

std::string_view Lexer::comment() {
  const char* start = p_;
  for (; p_ != end_; ++p_) {
    // A comment inside a comment is most often one whose closing bracket is missing, and would swallow what
    // follows.
    if (*p_ == '(') fail(GcodeErrorCode::kNestedComment, column());
    if (*p_ == ')') {
      const std::string_view text(start, static_cast<std::size_t>(p_ - start));
      ++p_;
      return text;
    }
  }
  fail(GcodeErrorCode::kUnclosedComment, static_cast<std::uint32_t>(start - begin_));
}

std::string show_byte(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte >= 0x20 && byte < 0x7F ? fmt::format("'{}'", c) : fmt::format("0x{:02X}", byte);
}

}  // namespace trn
