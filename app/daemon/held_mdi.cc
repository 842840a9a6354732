#include "app/daemon/held_mdi.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/letter_case.h"
#include "core/ports.h"

namespace trn {

namespace {

constexpr const char* kHeldLegal =
    "while a program is held, MDI takes M3, M4, M5, S, M7, M8, M9, and M64 or M65 with P, with plain numbers";

struct HeldWord {
  char letter = 0;
  double value = 0;
};

std::optional<std::vector<HeldWord>> held_words(std::string_view text) {
  std::vector<HeldWord> words;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto skip = [&] {
    while (at != end && std::isspace(static_cast<unsigned char>(*at)) != 0) ++at;
  };
  for (skip(); at != end; skip()) {
    HeldWord word{upper_case(*at++), 0};
    skip();
    const auto read = std::from_chars(at, end, word.value);
    if (std::isalpha(static_cast<unsigned char>(word.letter)) == 0 || read.ec != std::errc() ||
        !std::isfinite(word.value))
      return std::nullopt;
    at = read.ptr;
    words.push_back(word);
  }
  return words;
}

std::string why_not_held(const std::vector<HeldWord>& words, const HeldWord& word) {
  const bool moves = std::any_of(words.begin(), words.end(), [](const HeldWord& any) {
    return std::string_view("XYZABCUVW").find(any.letter) != std::string_view::npos;
  });
  const bool sets = word.letter == 'G' && word.value != 0 && word.value != 1;
  const bool sets_table = std::any_of(words.begin(), words.end(), [](const HeldWord& any) {
    return (any.letter == 'G' && any.value == 10) || (any.letter == 'M' && any.value == 61);
  });
  if (sets_table)
    return "offsets, tool lengths and the tool in the spindle would act in the middle of what is planned "
           "already; set them at a program stop (M0), or 'stop' the program, set them, and 'start --resume' "
           "goes on from this place with them";
  if (moves && !sets) return "an axis is moved with 'jog', and 'resume' leads it back";
  if (word.letter == 'G')
    return fmt::format("G{:g} would change what the held program goes on with; 'stop' ends it", word.value);
  if (word.letter == 'M' && word.value == 6) return "a tool is changed where the program asks for one";
  return fmt::format("{}{:g} is none of them", word.letter, word.value);
}

/// The line's words, each at most once but M.
struct HeldLine {
  std::optional<double> speed, output;
  std::vector<int> codes;
  std::string refusal;
};

HeldLine read_held(const std::vector<HeldWord>& words) {
  HeldLine line;
  for (const HeldWord& word : words) {
    const bool known_code = word.value == 3 || word.value == 4 || word.value == 5 || word.value == 7 ||
                            word.value == 8 || word.value == 9 || word.value == 64 || word.value == 65;
    if (word.letter == 'M' && known_code) {
      line.codes.push_back(static_cast<int>(word.value));
    } else if (word.letter == 'S' && word.value >= 0) {
      line.speed = word.value;
    } else if (word.letter == 'P' && word.value >= 0 && word.value < kMaxIo &&
               word.value == std::floor(word.value)) {
      line.output = word.value;
    } else {
      line.refusal = fmt::format("{}; {}", kHeldLegal, why_not_held(words, word));
      return line;
    }
  }
  return line;
}

const HeldWord* find_word(const std::vector<HeldWord>& words, char letter) {
  const auto found =
      std::find_if(words.begin(), words.end(), [&](const HeldWord& word) { return word.letter == letter; });
  return found == words.end() ? nullptr : &*found;
}

bool sets_tables(const std::vector<HeldWord>& words) {
  const HeldWord *g = find_word(words, 'G'), *m = find_word(words, 'M');
  const std::string_view letters = g ? "GLPHQRIJXYZABC" : "MQ";
  if (!(g && g->value == 10) && !(m && m->value == 61)) return false;
  return std::all_of(words.begin(), words.end(), [&](const HeldWord& word) {
    return letters.find(word.letter) != std::string_view::npos && find_word(words, word.letter) == &word;
  });
}

bool is_length_word(const std::vector<HeldWord>& words) {
  return words.size() == 1 && words[0].letter == 'G' && words[0].value == 43;
}

// The tool that is put in is not the one that the control knows of yet.
bool needs_spindle_tool(const std::vector<HeldWord>& words) {
  const HeldWord* l = find_word(words, 'L');
  return !l || (l->value != 1 && l->value != 2);
}

// None if the text is something else.
std::optional<HeldMdi> plan_held_tables(std::string_view text, HeldAt at) {
  HeldMdi out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    begin = end + 1;
    const auto words = held_words(line.substr(0, line.find('(')));  // behind it: the tool's remark
    if (!words) return std::nullopt;
    if (words->empty() || (is_length_word(*words) && !out.lines.empty())) continue;
    if (!sets_tables(*words)) return std::nullopt;
    if (at == HeldAt::kToolChange && needs_spindle_tool(*words))
      return HeldMdi{{},
                     "",
                     "the tool that the program waits for is not in the spindle before 'resume' confirms it; "
                     "give its length with 'trunnion tool NUMBER Z LENGTH', or touch off at the next stop"};
    out.lines += fmt::format("{}\n", line);
  }
  if (out.lines.empty()) return std::nullopt;
  return out;
}

}  // namespace

HeldMdi plan_held_mdi(std::string_view text, double program_speed, int coolant, HeldAt at) {
  using Kind = RtCommand::Kind;
  if (at != HeldAt::kPath)
    if (auto tables = plan_held_tables(text, at)) return *std::move(tables);
  const auto words = held_words(text);
  if (!words || words->empty()) return {{}, "", kHeldLegal};
  const HeldLine line = read_held(*words);
  if (!line.refusal.empty()) return {{}, "", line.refusal};
  HeldMdi out;
  const double speed = line.speed.value_or(program_speed);
  for (const int code : line.codes) {
    if (code <= 4 && speed <= 0)
      return {{}, "", fmt::format("M{} needs a speed here, as in M{} S1000", code, code)};
    if (code == 9) coolant = 0;
    if (code == 7 || code == 8) coolant |= code == 7 ? 1 : 2;
    if (code <= 5) out.commands.push_back({Kind::kSpindle, code == 5 ? 0 : code == 3 ? speed : -speed});
    if (code >= 7 && code <= 9) out.commands.push_back({Kind::kCoolant, 0, 0, coolant});
    if (code < 64) continue;
    if (!line.output) return {{}, "", fmt::format("M{} needs the output's number, as in M{} P2", code, code)};
    out.commands.push_back({Kind::kDigitalOutput, code == 64 ? 1.0 : 0.0, 0, static_cast<int>(*line.output)});
  }
  if (out.commands.empty())
    return {{}, "", "S or P alone switches nothing here; give it with its M, as in M3 S1000"};
  return out;
}

}  // namespace trn
