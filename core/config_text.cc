#include "core/config_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/letter_case.h"

namespace trn {

namespace {

constexpr std::string_view kDigits = "0123456789";

bool is_digit(char c) { return kDigits.find(c) != std::string_view::npos; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

bool starts_with_any(std::string_view text, std::initializer_list<std::string_view> begins) {
  return std::any_of(begins.begin(), begins.end(), [&](auto begin) { return text.starts_with(begin); });
}

// What word processors and phones make of a quote.
bool is_typographic(std::string_view value) {
  return starts_with_any(value, {"“", "”", "„", "‟", "‘", "’", "‚", "‛", "«", "»", "‹", "›", "″", "´", "`"});
}

// "1.000,5" as 1000.5: the last of several kinds parts the fraction.
std::string with_point(std::string_view number) {
  const std::size_t comma = number.rfind(','), point = number.rfind('.');
  std::size_t fraction = point == std::string_view::npos ? comma : std::max(comma, point);
  const bool only_commas = point == std::string_view::npos && number.find(',') != comma;
  if (only_commas) fraction = std::string_view::npos;
  std::string out;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (i == fraction)
      out += '.';
    else if (number[i] != ',' && number[i] != '.')
      out += number[i];
  }
  return out;
}

std::string explain_comma(std::string_view value) {
  const std::string meant = with_point(value);
  if (meant.find('.') == std::string::npos) return fmt::format("'{}' is no number; write {}", value, meant);
  std::string out = fmt::format("'{}' is no number; write {}, with a point", value, meant);
  const std::size_t comma = value.rfind(',');
  if (value.size() - comma == 4 && value.find('.') == std::string_view::npos &&
      meant[meant[0] == '-'] != '0') {
    std::string whole(value);
    whole.erase(comma, 1);
    out += fmt::format(", or {} if the comma parts the thousands", whole);
  }
  return out;
}

std::string explain_number(std::string_view value) {
  const bool sign = value[0] == '+' || value[0] == '-';
  const std::string_view body = value.substr(sign ? 1 : 0);
  if (body.find_first_not_of("0123456789.,") == std::string_view::npos &&
      body.find(',') != std::string_view::npos && is_digit(body.back()))
    return explain_comma(value);
  if (body[0] == '.')
    return fmt::format("write {}0{}: a point has a digit on both sides", value.substr(0, sign), body);
  if (body.back() == '.') return fmt::format("write {}0: a point has a digit on both sides", value);
  const std::size_t end = body.find_first_not_of("0123456789.");
  if (end == std::string_view::npos) {
    const std::size_t first = std::min(body.find_first_not_of('0'), body.size() - 1);
    const bool zeros = first > 0 && is_digit(body[first]);
    return zeros
               ? fmt::format("write {}{}, without zeros in front", value.substr(0, sign), body.substr(first))
               : "";
  }
  const std::string_view rest = trimmed(body.substr(end));
  if (rest.find_first_not_of("0123456789.") == std::string_view::npos)
    return fmt::format("'{}' is no number; leave out the space in it", value);
  const bool prefix = body.starts_with("0x") || body.starts_with("0o") || body.starts_with("0b");
  const std::size_t power = rest.find_first_not_of("eE+-");
  const bool exponent =
      lower_case(rest[0]) == 'e' && power != std::string_view::npos && is_digit(rest[power]);
  const bool unit = is_letter(rest[0]) || starts_with_any(rest, {"%", "°", "µ", "μ", "\""});
  return unit && !prefix && !exponent ? fmt::format("write {} without a unit; the key's name has it",
                                                    value.substr(0, end + (sign ? 1 : 0)))
                                      : "";
}

constexpr std::array<std::string_view, 30> kUnits = {
    "mm",      "cm",     "m",   "um",     "nm", "inch", "inches",  "in", "ft", "deg",
    "degrees", "degree", "rad", "arcsec", "s",  "s2",   "s3",      "ms", "us", "sec",
    "min",     "min2",   "h",   "rpm",    "hz", "khz",  "percent", "n",  "k",  "kg"};

// "max" of "max_mm": units at the end are left out, but never the whole key.
std::string_view quantity_of(std::string_view key) {
  for (;;) {
    const std::size_t bar = key.rfind('_');
    if (bar == std::string_view::npos || bar == 0) return key;
    if (std::find(kUnits.begin(), kUnits.end(), key.substr(bar + 1)) == kUnits.end()) return key;
    key = key.substr(0, bar);
  }
}

}  // namespace

std::string explain_value(std::string_view line) {
  const std::size_t equals = line.find('=');
  const std::string_view key = trimmed(line.substr(0, std::min(equals, line.size())));
  if (equals == std::string_view::npos || key.find_first_of("\"'#[{") != std::string_view::npos) return "";
  std::string_view value = line.substr(equals + 1);
  value = trimmed(value.substr(0, value.find('#')));
  if (value.empty()) return "";
  const std::size_t digit = value.find_first_of("+-") == 0 ? 1 : 0;
  const bool point = value.substr(digit).starts_with('.');
  if (digit + point < value.size() && is_digit(value[digit + point])) return explain_number(value);
  if (is_typographic(value)) return fmt::format("a text stands in straight quotes, as {} = \"...\"", key);
  if (!is_letter(value[0])) return "";
  const std::string small = lower_case(value);
  if (value == "true" || value == "false" || value == "nan" || value == "inf") return "";
  if (small == "true" || small == "false") return fmt::format("write {}, in small letters", small);
  for (const std::string_view word : {"yes", "no", "on", "off"})
    if (small == word) return "write true or false";
  return value.find_first_of("\"'\\") == std::string_view::npos
             ? fmt::format("a text stands in straight quotes: {} = \"{}\"", key, value)
             : fmt::format("a text stands in straight quotes, as {} = \"...\"", key);
}

std::string explain_structure(std::string_view line, std::string_view reason) {
  line = trimmed(line.substr(0, line.find('#')));
  if (line.empty()) return "";
  constexpr std::string_view kTwice = "cannot redefine existing ";
  if (const std::size_t found = reason.find(kTwice); found != std::string_view::npos) {
    const std::size_t begin = reason.find('\'', found), end = reason.find('\'', begin + 1);
    if (end == std::string_view::npos) return "";
    const std::string_view name = reason.substr(begin + 1, end - begin - 1);
    return line[0] == '['
               ? fmt::format("'{0}' is there already; each table of a list stands as [[{0}]]", name)
               : fmt::format("'{}' is there already, further up in this table", name);
  }
  const auto is_about = [&](std::string_view words) { return reason.find(words) != std::string_view::npos; };
  const bool has_equals = line.find('=') != std::string_view::npos;
  if (is_about("table header") && !has_equals) {
    const std::size_t begin = std::min(line.find_first_not_of("[ \t"), line.size());
    const std::string_view name = trimmed(line.substr(begin, line.find(']') - begin));
    return name.empty() || name[0] == ']'
               ? "a table is named in [ ], one of a list in [[ ]]"
               : fmt::format("a table is named in [ ], one of a list in [[ ]]: [{0}] or [[{0}]]", name);
  }
  const bool is_other = line[0] == '{' || (line.find(':') != std::string_view::npos && !has_equals);
  return is_other && (is_about("expected '='") || is_about("expected keys"))
             ? "a config is TOML: [machine] begins a table, and its lines are key = value"
             : "";
}

bool same_quantity(std::string_view key, std::string_view other) {
  return key != other && quantity_of(key) == quantity_of(other);
}

}  // namespace trn
