#include "interp/gcode/text/foreign_words.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/letter_case.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/lexer.h"

namespace trn {

namespace {

struct ForeignWord {
  std::string_view text;  ///< lower case
  GcodeErrorCode code;
};
constexpr ForeignWord kForeignWords[] = {
    {"if", GcodeErrorCode::kForeignBranch},     {"then", GcodeErrorCode::kForeignBranch},
    {"else", GcodeErrorCode::kForeignBranch},   {"elseif", GcodeErrorCode::kForeignBranch},
    {"endif", GcodeErrorCode::kForeignBranch},  {"while", GcodeErrorCode::kForeignLoop},
    {"do", GcodeErrorCode::kForeignLoop},       {"end", GcodeErrorCode::kForeignLoop},
    {"endwhile", GcodeErrorCode::kForeignLoop}, {"for", GcodeErrorCode::kForeignLoop},
    {"endfor", GcodeErrorCode::kForeignLoop},   {"loop", GcodeErrorCode::kForeignLoop},
    {"endloop", GcodeErrorCode::kForeignLoop},  {"repeat", GcodeErrorCode::kForeignLoop},
    {"until", GcodeErrorCode::kForeignLoop},    {"goto", GcodeErrorCode::kForeignJump},
    {"gotof", GcodeErrorCode::kForeignJump},    {"gotob", GcodeErrorCode::kForeignJump},
    {"gotos", GcodeErrorCode::kForeignJump}};

/// Letters in a row, outside comments, brackets and parameter names.
struct LetterRun {
  std::size_t at = 0;
  std::string text;  ///< lower case
  bool bracket_follows = false;
};

std::size_t behind(std::string_view line, std::size_t i, char close) {
  const std::size_t end = line.find(close, i);
  return end == std::string_view::npos ? line.size() : end + 1;
}

// The next one from i on, which moves behind it; an empty text at the end.
LetterRun next_run(std::string_view line, std::size_t& i) {
  LetterRun run;
  int depth = 0;
  while (i < line.size()) {
    const char c = line[i];
    if (c == ';') break;
    // Comments and names of parameters may have any words in them.
    if (c == '(' || c == '<') {
      i = behind(line, i, c == '(' ? ')' : '>');
      continue;
    }
    // Inside brackets letters are functions and operators of this language.
    depth += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (depth > 0 || !Lexer::is_letter(c)) {
      ++i;
      continue;
    }
    run.at = i;
    for (; i < line.size() && Lexer::is_letter(line[i]); ++i) run.text += lower_case(line[i]);
    run.bracket_follows = i < line.size() && line[i] == '[';
    break;
  }
  return run;
}

// An unknown word makes one of these of its letters.
bool may_be_of_a_word(GcodeErrorCode code) {
  constexpr std::array kCodes = {GcodeErrorCode::kBadExpression, GcodeErrorCode::kMissingValue,
                                 GcodeErrorCode::kNoSuchAxis,    GcodeErrorCode::kFlowSyntax,
                                 GcodeErrorCode::kLineNumber,    GcodeErrorCode::kBadCharacter};
  return std::find(kCodes.begin(), kCodes.end(), code) != kCodes.end();
}

constexpr std::string_view kAlarm =
    "#3000 and #3006 are parameters like any other here; (ABORT,text) stops a program with a message, M0 "
    "waits "
    "for the operator";
constexpr std::string_view kPosition =
    "this parameter is always 0 here; #5420 to #5425 are the position, #<_abs_x> and its kind that of the "
    "machine";

}  // namespace

void refuse_foreign_word(std::string_view line, const BlockError& error) {
  if (!may_be_of_a_word(error.code)) return;
  std::size_t i = 0;
  for (LetterRun run = next_run(line, i); !run.text.empty(); run = next_run(line, i)) {
    if (run.text == "o") return;  // what follows is an O-word, with messages of its own
    const auto column = static_cast<std::uint32_t>(run.at) + 1;
    for (const ForeignWord& word : kForeignWords)
      if (word.text == run.text) fail(word.code, column);
    // Only a word at which the line really failed is called foreign; others of the line may be in order.
    const bool here = error.column >= column && error.column <= column + run.text.size();
    if (here && run.text.size() > 1 && !run.bracket_follows) fail(GcodeErrorCode::kForeignWord, column);
  }
}

ForeignParameter foreign_parameter(const ParsedBlock& block) {
  for (const Assignment& a : block.assignments)
    if (a.target == Assignment::Target::kNumber && (a.index == 3000 || a.index == 3006))
      return {kAlarm, a.column};
  for (const Instruction& i : block.code) {
    if (i.op != Op::kNumbered) continue;
    // Fanuc's numbers: 5001 to 5008 the end of the block before, 5021 to 5028 and 5041 to 5048 the present
    // place in machine and work coordinates.
    const bool position = (i.index >= 5001 && i.index <= 5008) || (i.index >= 5021 && i.index <= 5028) ||
                          (i.index >= 5041 && i.index <= 5048);
    if (position) return {kPosition, i.column};
  }
  return {};
}

}  // namespace trn
