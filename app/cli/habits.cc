#include "app/cli/habits.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/letter_case.h"

namespace trn {

namespace {

constexpr std::string_view kDigits = "0123456789";

bool is_signed_number(std::string_view text) {
  const std::size_t digit = text.find_first_of(kDigits);
  return digit != std::string_view::npos &&
         text.find_first_not_of("0123456789.", 1) == std::string_view::npos &&
         std::count(text.begin(), text.end(), '.') <= 1;
}

bool is_name(std::string_view text) {
  return !text.empty() && text.find_first_of("+-.") == std::string_view::npos &&
         kDigits.find(text.front()) == std::string_view::npos;
}

// To people -.5 is a number, and to CLI11 an option.
std::string with_zero(std::string word) {
  if (word.starts_with("-.") && word.find_first_of(kDigits) == 2) word.insert(1, "0");
  return word;
}

// X+, +X, X-5: an axis with a sign and perhaps a number. Without a sign it may be a joint's own name, as X2.
void part_axis(std::vector<std::string>& words) {
  if (words.size() < 2) return;
  const std::string word = words[1];
  const std::size_t sign = word.find_first_of("+-");
  if (sign == std::string::npos) return;
  if (sign == 0 && word[0] == '-') return;  // an option
  const std::string name = sign == 0 ? word.substr(1) : word.substr(0, sign);
  const std::string way = sign == 0 ? word.substr(0, 1) : with_zero(word.substr(sign));
  if (!is_name(name) || (way.size() > 1 && !is_signed_number(way))) return;
  words[1] = name;
  words.insert(words.begin() + 2, way);
}

// "rapid 50%" and "50% rapid".
void name_override(std::vector<std::string>& words) {
  static constexpr std::array<std::string_view, 4> kWhose = {"feed", "rapid", "spindle", "adaptive"};
  for (std::size_t i = 1; i < words.size() && i < 3; ++i) {
    std::string& word = words[i];
    if (word.ends_with('%') && word.find_first_not_of("0123456789.") == word.size() - 1) word.pop_back();
    const std::string small = lower_case(word);
    if (std::find(kWhose.begin(), kWhose.end(), small) == kWhose.end() || words[i - 1] == "--of") continue;
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(i));
    words.insert(words.end(), {"--of", small});
    --i;
  }
}

}  // namespace

std::vector<std::string> as_commands_read(std::vector<std::string> words) {
  std::transform(words.begin(), words.end(), words.begin(), with_zero);
  if (words.empty()) return words;
  if (words[0] == "jog") part_axis(words);
  if (words[0] == "override") name_override(words);
  return words;
}

}  // namespace trn
