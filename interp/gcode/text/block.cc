#include "interp/gcode/text/block.h"

#include <fmt/format.h>

#include <cmath>

#include "interp/gcode/error.h"
#include "interp/gcode/text/foreign_codes.h"

namespace trn {

namespace {

// G[1 + 0.1 * 5] may come out as 1.4999999. Codes have one decimal, so a thousandth of a tenth is rounding.
constexpr double kCodeTolerance = 1e-3;
constexpr GCode kCancelMotion = 80_g;
constexpr int kMWordsMax = 4;  // of a line (RS274/NGC section 3.3.1)

int to_code(double value, double scale, std::uint32_t column, char letter) {
  // G codes are held in tenths, M codes as they are.
  const double scaled = value * scale;
  const double rounded = std::round(scaled);
  if (!(std::fabs(scaled - rounded) <= kCodeTolerance) || rounded < 0 || rounded > 99999) {
    const std::string name = fmt::format("{}{}", letter, value);
    fail(letter == 'G' ? GcodeErrorCode::kUnknownG : GcodeErrorCode::kUnknownM, column, name);
  }
  return static_cast<int>(rounded);
}

void add_g(const ModalTable& table, double value, std::uint32_t column, Block& out) {
  const GCode code = g_from_tenths(to_code(value, 10, column, 'G'));
  const int group = table.g_group(code);
  if (group < 0) refuse_unknown_g(code, column);
  GCode& slot = out.g[static_cast<std::size_t>(group)];
  if (code == kCancelMotion && slot != kNoGCode) return;  // G80 goes with any other code of its group
  // Codes that the config ignores may stand together: they mean nothing.
  if (slot != kNoGCode && slot != kCancelMotion && group != static_cast<int>(GGroup::kIgnored))
    fail(GcodeErrorCode::kGroupConflict, column, g_name(slot), g_name(code));
  slot = code;
  out.g_column[static_cast<std::size_t>(group)] = column;
  out.any_g = true;
}

// Groups of ours that are one in the dialect: M3 to M5 and M70 to M73, M2 and M99.
int partner(int group) {
  switch (static_cast<MGroup>(group)) {
    case MGroup::kSpindle:
      return static_cast<int>(MGroup::kState);
    case MGroup::kState:
      return static_cast<int>(MGroup::kSpindle);
    case MGroup::kStop:
      return static_cast<int>(MGroup::kSub);
    case MGroup::kSub:
      return static_cast<int>(MGroup::kStop);
    default:
      return -1;
  }
}

void add_m(const ModalTable& table, double value, std::uint32_t column, Block& out) {
  const int code = to_code(value, 1, column, 'M');
  const int group = table.m_group(code);
  if (group < 0) refuse_unknown_m(code, column);
  std::int16_t& slot = out.m[static_cast<std::size_t>(group)];
  for (const int other : {group, partner(group)}) {
    const int taken = other < 0 ? -1 : out.m[static_cast<std::size_t>(other)];
    if (taken >= 0)
      fail(GcodeErrorCode::kGroupConflict, column, fmt::format("M{}", taken), fmt::format("M{}", code));
  }
  slot = static_cast<std::int16_t>(code);
  out.m_column[static_cast<std::size_t>(group)] = column;
  out.any_m = true;
}

}  // namespace

void Block::clear() {
  present = 0;
  // Most lines have no M and many no G code; the tables are cleared only when the line before has filled
  // them.
  if (any_g || parsed == nullptr) g.fill(kNoGCode);
  if (any_m || parsed == nullptr) m.fill(-1);
  any_g = any_m = false;
}

void evaluate_block(const ParsedBlock& parsed, Evaluator& evaluator, const ModalTable& table, Block& out) {
  out.clear();
  out.parsed = &parsed;
  int m_words = 0;
  for (const ParsedWord& word : parsed.words) {
    const double value = word.expression < 0 ? word.value : evaluator.run(parsed.code, word.expression);
    if (word.letter == 'G') {
      add_g(table, value, word.column, out);
    } else if (word.letter == 'M') {
      if (++m_words > kMWordsMax) fail(GcodeErrorCode::kTooManyWords, word.column, kMWordsMax, "M codes");
      add_m(table, value, word.column, out);
    } else {
      if (out.has(word.letter)) fail(GcodeErrorCode::kRepeatedWord, word.column, shown_letter(word.letter));
      const auto i = static_cast<std::size_t>(word.letter - 'A');
      out.present |= Block::bit(word.letter);
      out.value[i] = value;
      out.column[i] = word.column;
    }
  }
}

}  // namespace trn
