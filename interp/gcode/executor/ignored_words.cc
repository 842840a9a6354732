#include <fmt/format.h>

#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/foreign_codes.h"

// Words of other controls that the config passes over: [program] ignored.
namespace trn {

namespace {

bool ignored_g(const MappedWord& word) { return word.g_code != kNoGCode; }

bool values_stand(const MappedWord& word, const Block& b) {
  for (const auto& [letter, value] : word.values)
    if (!b.has(letter) || b[letter] != value) return false;
  return true;
}

// The line is this G code with these words, and nothing else.
bool is_whole_line(const MappedWord& word, const Block& b) {
  int codes = 0;
  bool found = false;
  for (const GCode code : b.g) {
    codes += code != kNoGCode;
    found |= code == word.g_code;
  }
  std::uint32_t letters = 0;
  for (const auto& [letter, value] : word.values) letters |= Block::bit(letter);
  return found && codes == 1 && !b.any_m && b.present == letters && b.parsed->assignments.empty() &&
         b.parsed->keywords.empty() && values_stand(word, b);
}

std::string letters_of(std::uint32_t mask) {
  std::string text;
  for (char letter = 'A'; letter < 'A' + static_cast<char>(Block::kLetters); ++letter)
    if (mask & Block::bit(letter)) text += fmt::format(" {}", shown_letter(letter));
  return text;
}

}  // namespace

void Executor::map_words(ModalTable& table) const {
  for (const MappedWord& word : parts_.config.words) {
    if (word.m_code >= 0) table.map_m(word.m_code, MGroup::kRtcp);
    if (word.g_code != kNoGCode && !word.alone) table.map_g(word.g_code, GGroup::kIgnored);
  }
}

void Executor::drop_ignored(Block& b) {
  if (!ignores_ || !(b.any_g || b.any_m)) return;
  for (std::size_t i = 0; i < parts_.config.words.size(); ++i) {
    const MappedWord& word = parts_.config.words[i];
    const bool m = word.m_code >= 0 && word.action == WordAction::kIgnore && b.any_m &&
                   b.code(MGroup::kRtcp) == word.m_code;
    if (m) drop_words(b, i, b.at(MGroup::kRtcp), Block::kAxisLetters | Block::kPolarLetters);
    if (!ignored_g(word) || !b.any_g) continue;
    if (word.alone && is_whole_line(word, b)) {
      drop_words(b, i, b.first_g_column(), 0);
      b.g.fill(kNoGCode);
    } else if (!word.alone && b.code(GGroup::kIgnored) == word.g_code && values_stand(word, b)) {
      const bool moves = b.has(GGroup::kMotion) || other_axis_code(b);
      drop_words(b, i, b.at(GGroup::kIgnored), moves ? Block::kAxisLetters | Block::kPolarLetters : 0);
      b.g[static_cast<std::size_t>(GGroup::kIgnored)] = kNoGCode;
    }
  }
  if (b.any_g && b.has(GGroup::kIgnored)) refuse_unknown_g(b.code(GGroup::kIgnored), b.at(GGroup::kIgnored));
}

// What nothing else on the line uses belongs to the ignored code. F, S and T always keep their meaning, and
// so do the letters `kept`.
void Executor::drop_words(Block& b, std::size_t index, std::uint32_t column, std::uint32_t kept) {
  const MappedWord& word = parts_.config.words[index];
  const std::uint32_t others = Block::bit('F') | Block::bit('S') | Block::bit('T') | kept;
  std::uint32_t used = others;
  if (!word.alone)
    used |= used_letters(b, b.code(GGroup::kMotion)) & ~(Block::kAxisLetters | Block::kPolarLetters);
  const std::uint32_t dropped = b.present & ~used;
  b.present &= used;
  const bool place = (dropped & (Block::kAxisLetters | Block::kPolarLetters)) != 0;
  if (!warned_words_[index] || (place && !word.alone))
    parts_.warn(column, fmt::format("{} is ignored, as the config says{}{}", word.text,
                                    dropped ? ", with its words" : "", letters_of(dropped)));
  warned_words_[index] = true;
}

}  // namespace trn
