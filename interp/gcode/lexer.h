#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace trn {

/// Reads one line of G code: case and white space do not matter outside comments. Columns are 1-based bytes.
class Lexer {
 public:
  explicit Lexer(std::string_view line)
      : begin_(line.data()), p_(line.data()), end_(line.data() + line.size()) {}

  /// Next byte that is not white space, lower case; 0 at the end of the line.
  char peek() {
    while (p_ != end_ && (*p_ == ' ' || *p_ == '\t')) ++p_;
    return p_ == end_ ? '\0' : lower(*p_);
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

  static char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

 private:
  double spaced_number(const char* start, bool negative);

  const char* begin_;
  const char* p_;
  const char* end_;
};

/// How a byte is shown in messages: itself, or its hexadecimal value.
std::string show_byte(char c);

}  // namespace trn
