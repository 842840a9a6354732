#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/lexer.h"

namespace trn {

/// Turns the text of one line into a ParsedBlock. Keeps no state of the program but the names it has seen.
class Parser {
 public:
  /// `names` for parameters; `labels` for O-words; `words` as in ProgramConfig. All must outlive the parser.
  Parser(NameTable& names, NameTable& labels, const std::vector<MappedWord>& words);

  /// Fills `out` (cleared first; its memory is used again). BlockError with the column.
  void parse(std::string_view line, ParsedBlock& out);

  /// True if the line begins an O-word; cheap, for skipping and indexing.
  static bool is_flow_line(std::string_view line);
  /// Only the O-word of the line (kNone if it has none): for skipping over and indexing blocks.
  void parse_flow_only(std::string_view line, ParsedBlock& out);

 private:
  void line(Lexer& lexer, ParsedBlock& out);
  void segments(Lexer& lexer, ParsedBlock& out);
  static void spindle_number(Lexer& lexer);
  void other_segment(Lexer& lexer, char c, ParsedBlock& out);
  void word(Lexer& lexer, char name, ParsedBlock& out);
  void word_value(Lexer& lexer, ParsedWord& parsed, ParsedBlock& out);
  void assignment(Lexer& lexer, ParsedBlock& out);
  void comment(Lexer& lexer, ParsedBlock& out);
  bool keyword(Lexer& lexer, char letter, ParsedBlock& out);
  void flow(Lexer& lexer, ParsedBlock& out);
  void flow_label(Lexer& lexer, ParsedBlock& out);
  void flow_arguments(Lexer& lexer, ParsedBlock& out);
  void line_number(Lexer& lexer);

  NameTable& names_;
  NameTable& labels_;
  const std::vector<MappedWord>& words_;
  std::array<bool, 256> begins_keyword_{};
};

}  // namespace trn
