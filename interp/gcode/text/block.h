#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/text/expression.h"

namespace trn {

/// A letter with its value: a number, or an expression of the block's code.
struct ParsedWord {
  double value = 0;
  std::int32_t expression = -1;  ///< start in ParsedBlock::code, or -1
  std::uint32_t column = 0;
  char letter = 0;
};

/// #target = value, done after the whole line has been read.
struct Assignment {
  enum class Target : std::uint8_t { kNumber, kExpression, kLocal, kGlobal, kReadOnly };
  Target target = Target::kNumber;
  std::int32_t index = 0;  ///< parameter number, start of an expression, or name id
  std::int32_t value = 0;  ///< start of the expression
  std::uint32_t column = 0;
};

enum class FlowKind : std::uint8_t {
  kNone,
  kSub,
  kEndSub,
  kCall,
  kReturn,
  kWhile,
  kEndWhile,
  kDo,
  kIf,
  kElseIf,
  kElse,
  kEndIf,
  kRepeat,
  kEndRepeat,
  kBreak,
  kContinue,
  kProgramNumber,  ///< a bare O1234: a program or sub-program of the M98 kind starts here
};

/// An O-word: label and what it does. Arguments are starts of expressions.
struct FlowWord {
  FlowKind kind = FlowKind::kNone;
  std::int32_t label = -1;  ///< id in Labels, or -1: label_expression
  std::int32_t label_expression = -1;
  std::uint32_t column = 0;
  std::vector<std::int32_t> arguments;
};

enum class CommentKind : std::uint8_t {
  kNone,
  kPlain,
  kMessage,
  kDebug,
  kPrint,
  kLog,
  kLogOpen,
  kLogAppend,
  kLogClose,
  kProbeOpen,
  kProbeClose,
  kAbort,
  kIgnored
};

/// One line, parsed once and evaluated as often as it runs.
struct ParsedBlock {
  std::vector<ParsedWord> words;
  std::vector<Assignment> assignments;
  std::vector<Instruction> code;
  FlowWord flow;
  std::vector<std::int32_t> keywords;  ///< indices in ProgramConfig::words
  std::vector<std::uint32_t> keyword_columns;
  CommentKind comment_kind = CommentKind::kNone;
  std::string comment;
  std::string text;  ///< the line for people: without blanks around it, at most kTextMax bytes
  static constexpr std::size_t kTextMax = 95;
  bool block_delete = false;
  bool percent = false;

  void clear();
  bool is_flow() const { return flow.kind != FlowKind::kNone; }
};

/// The words @ (distance from the origin) and ^ (angle) stand behind Z.
inline constexpr char kPolarRadius = '[', kPolarAngle = '\\';
/// A word's letter as it stands in the program.
constexpr char shown_letter(char letter) {
  return letter == kPolarRadius ? '@' : letter == kPolarAngle ? '^' : letter;
}

/// The values of one line at one pass.
struct Block {
  static constexpr std::size_t kLetters = 28;
  std::uint32_t present = 0;  ///< bit letter - 'A'
  std::uint32_t line = 0;
  std::array<double, kLetters> value;
  std::array<std::uint32_t, kLetters> column;
  std::array<GCode, kGGroupCount> g;  ///< kNoGCode: none
  std::array<std::uint32_t, kGGroupCount> g_column;
  std::array<std::int16_t, kMGroupCount> m;  ///< -1 none
  std::array<std::uint32_t, kMGroupCount> m_column;
  bool any_g = false, any_m = false;
  const ParsedBlock* parsed = nullptr;

  bool has(char letter) const { return present >> (letter - 'A') & 1U; }
  double operator[](char letter) const { return value[static_cast<std::size_t>(letter - 'A')]; }
  std::uint32_t at(char letter) const {
    return has(letter) ? column[static_cast<std::size_t>(letter - 'A')] : 1;
  }
  double get(char letter, double fallback) const { return has(letter) ? (*this)[letter] : fallback; }
  bool has(GGroup group) const { return code(group) != kNoGCode; }
  bool has(MGroup group) const { return code(group) >= 0; }
  GCode code(GGroup group) const { return g[static_cast<std::size_t>(group)]; }
  std::int16_t code(MGroup group) const { return m[static_cast<std::size_t>(group)]; }
  std::uint32_t at(GGroup group) const { return g_column[static_cast<std::size_t>(group)]; }
  std::uint32_t at(MGroup group) const { return m_column[static_cast<std::size_t>(group)]; }
  std::uint32_t first_g_column() const {
    for (std::size_t i = 0; i < g.size(); ++i)
      if (g[i] != kNoGCode) return g_column[i];
    return 1;
  }
  std::uint32_t motion_column() const { return has(GGroup::kMotion) ? at(GGroup::kMotion) : 1; }
  bool has_axis_word() const { return (present & (kAxisLetters | kPolarLetters)) != 0; }
  bool has_polar() const { return (present & kPolarLetters) != 0; }
  void clear();

  static constexpr std::uint32_t bit(char letter) { return 1U << (letter - 'A'); }
  static constexpr std::uint32_t kAxisLetters = (1U << ('A' - 'A')) | (1U << ('B' - 'A')) |
                                                (1U << ('C' - 'A')) | (1U << ('X' - 'A')) |
                                                (1U << ('Y' - 'A')) | (1U << ('Z' - 'A'));
  static constexpr std::uint32_t kPolarLetters = 3U << (kPolarRadius - 'A');
};

/// Fills `out` from the parsed line: evaluates, sorts G and M codes into their groups, refuses repeated
/// words, conflicts of a group and unknown codes. Throws BlockError.
void evaluate_block(const ParsedBlock& parsed, Evaluator& evaluator, const ModalTable& table, Block& out);

}  // namespace trn
