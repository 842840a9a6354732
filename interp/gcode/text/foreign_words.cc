#include "interp/gcode/text/foreign_words.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/letter_case.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/lexer.h"
#include "interp/gcode/text/lookalikes.h"

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

// What is written between two values, inside brackets alone.
constexpr std::string_view kOperators[] = {"mod", "and", "or", "xor", "eq", "ne", "gt", "ge", "lt", "le"};
constexpr std::string_view kOperatorSigns = "+-*/";

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

// The place of the next character that is no white space; the line's end if there is none.
std::size_t next_seen(std::string_view line, std::size_t i) {
  return std::min(line.find_first_not_of(" \t", i), line.size());
}

void refuse_word(std::string_view line, const BlockError& error) {
  std::size_t i = 0;
  for (LetterRun run = next_run(line, i); !run.text.empty(); run = next_run(line, i)) {
    if (run.text == "o") return;  // what follows is an O-word, with messages of its own
    const auto column = static_cast<std::uint32_t>(run.at) + 1;
    for (const ForeignWord& word : kForeignWords)
      if (word.text == run.text) fail(word.code, column);
    // Only a word at which the line really failed is called foreign; others of the line may be in order.
    const bool here = error.column >= column && error.column <= column + run.text.size();
    if (!here) continue;
    if (run.at > 0 && std::ranges::find(kOperators, run.text) != std::end(kOperators))
      fail(GcodeErrorCode::kOutsideBrackets, column, upper_case(run.text));
    if (run.text.size() > 1 && !run.bracket_follows) fail(GcodeErrorCode::kForeignWord, column);
  }
}

// A character in the place of a word, or of its value.
void refuse_lookalike(std::string_view line, const BlockError& error) {
  if (error.column == 0 || error.column > line.size()) return;
  std::size_t at = error.column - 1;
  if (error.code == GcodeErrorCode::kMissingValue) at = next_seen(line, at + 1);  // behind the letter
  if (const auto like = lookalike(line.substr(at)))
    fail(GcodeErrorCode::kLookalike, static_cast<std::uint32_t>(at) + 1, like->code_point,
         like->meant == ' ' ? "a space" : std::string{'\'', like->meant, '\''});
}

// A sign between two words, or behind a value.
void refuse_sign(std::string_view line, const BlockError& error) {
  if (error.code != GcodeErrorCode::kBadCharacter || error.column == 0 || error.column > line.size()) return;
  const std::size_t at = error.column - 1;
  const bool is_first = next_seen(line, 0) == at;
  const std::size_t next = next_seen(line, at + 1);
  if (is_first || next == line.size()) return;
  const char letter = upper_case(line[next]);
  const bool skips = line[at] == '/' && Lexer::is_letter(letter);  // what follows, on some controls
  if (kOperatorSigns.find(line[at]) != std::string_view::npos && !skips)
    fail(GcodeErrorCode::kOutsideBrackets, error.column, line[at]);
  if (line[at] != ',') return;
  if (Lexer::is_digit(letter)) fail(GcodeErrorCode::kDecimalComma, error.column);
  if (letter == 'C' || letter == 'R') fail(GcodeErrorCode::kForeignCorner, error.column, letter);
}

}  // namespace

void refuse_slip(std::string_view line, const BlockError& error) {
  if (!may_be_of_a_word(error.code)) return;
  refuse_lookalike(line, error);
  refuse_word(line, error);
  refuse_sign(line, error);
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
