#include "app/cli/topics.h"

#include <fmt/format.h>

#include <cctype>
#include <string_view>

#include "app/cli/config_keys.h"
#include "app/cli/config_page.h"
#include "app/cli/config_specimens.h"
#include "app/cli/reference.h"
#include "core/letter_case.h"

namespace trn {

namespace {

// "g01" -> "G1", "m428" -> "M428"; "" if it is no code.
std::string code_name(const std::string& word) {
  if (word.size() == 1 && std::isalpha(static_cast<unsigned char>(word[0]))) return upper_case(word);
  if (word.size() < 2 || (lower_case(word[0]) != 'g' && lower_case(word[0]) != 'm')) return "";
  std::string number = word.substr(1);
  if (number.find_first_not_of("0123456789.") != std::string::npos || number[0] == '.') return "";
  number.erase(0, std::min(number.find_first_not_of('0'), number.size() - 1));
  if (number[0] == '.') number.insert(0, "0");
  return upper_case(word[0]) + number;
}

}  // namespace

std::string topic_text(const std::string& name) {
  if (name.empty()) return "";
  if (const std::string code = code_name(name); !code.empty()) {
    const std::string text = code_in_page(kGcodePage, code);
    return text.empty() ? "" : fmt::format("{}\nMore is in docs/gcode.md.\n", text);
  }
  std::string out;
  const auto add = [&](const std::string& text) { out += (out.empty() || text.empty() ? "" : "\n") + text; };
  add(rows_in_page(kFaultPage, name));
  add(rows_in_page(kGlossaryPage, name));
  add(rows_in_page(config_page(gather_keys(ask_all_readers())), name));
  return out;
}

}  // namespace trn
