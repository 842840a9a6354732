#include "interp/gcode/lexer.h"

#include <fast_float/fast_float.h>

#include <array>

#include "interp/gcode/error.h"

namespace trn {

namespace {

constexpr std::array<double, 19> kPowersOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                                                 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};

constexpr double kNumberLimit = 1e15;  // longer ones have lost their last digit before the point

// The usual short number: all digits fit exactly into a double, so that one division rounds right (Clinger
// 1990). False for anything longer; `stop` is then not set.
bool parse_short(const char* first, const char* last, double& value, const char** stop) {
  constexpr std::ptrdiff_t kExactDigits = 15;
  std::uint64_t digits = 0;
  const char* point = last;
  const char* p = first;
  for (; p != last; ++p) {
    const unsigned digit = static_cast<unsigned char>(*p) - static_cast<unsigned>('0');
    if (digit <= 9)
      digits = digits * 10 + digit;
    else if (*p == '.' && point == last)
      point = p;
    else
      break;
  }
  const std::ptrdiff_t after_point = p > point ? p - point - 1 : 0;
  const std::ptrdiff_t count = (p - first) - (p > point ? 1 : 0);
  if (count == 0 || count > kExactDigits) return false;
  value = static_cast<double>(digits) / kPowersOfTen[static_cast<std::size_t>(after_point)];
  *stop = p;
  return true;
}

double parse_digits(const char* first, const char* last, std::uint32_t column, const char** stop) {
  double value = 0;
  if (parse_short(first, last, value, stop)) return value;
  const auto result = fast_float::from_chars(first, last, value, fast_float::chars_format::fixed);
  if (result.ec != std::errc() || !(value < kNumberLimit)) fail(GcodeErrorCode::kBadNumber, column);
  *stop = result.ptr;
  return value;
}

}  // namespace

bool Lexer::accept_word(std::string_view word) {
  const char* start = p_;
  for (const char c : word) {
    if (peek() != c) {
      p_ = start;
      return false;
    }
    ++p_;
  }
  return true;
}

double Lexer::number() {
  bool negative = false;
  char c = peek();
  if (c == '+' || c == '-') {
    negative = c == '-';
    ++p_;
    c = peek();
  }
  if (!is_digit(c) && c != '.') fail(GcodeErrorCode::kBadNumber, column());
  const char* start = p_;
  const double value = parse_digits(p_, end_, column(), &p_);
  c = peek();
  if (is_digit(c) || c == '.') return spaced_number(start, negative);
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
    if (c == '(' || c == '#' || c == '[') fail(GcodeErrorCode::kBadName, at);
    text += c;
  }
  if (text.empty()) fail(GcodeErrorCode::kBadName, at);
  return text;
}

std::string_view Lexer::comment() {
  const char* start = p_;
  for (; p_ != end_; ++p_) {
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
