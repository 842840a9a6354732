#include "interp/gcode/text/parser.h"

#include <fmt/format.h>

#include <algorithm>

#include "interp/gcode/error.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/foreign_words.h"
#include "interp/gcode/text/lexer.h"

namespace trn {

namespace {

constexpr std::size_t kMaxCallArguments = 30;
// No postprocessor writes so many. A line of garbage must not make the block grow without bound.
constexpr std::size_t kMaxWords = 200;

struct FlowName {
  std::string_view text;
  FlowKind kind;
};
// A name that begins another comes after it.
constexpr FlowName kFlowNames[] = {{"sub", FlowKind::kSub},
                                   {"endsub", FlowKind::kEndSub},
                                   {"call", FlowKind::kCall},
                                   {"return", FlowKind::kReturn},
                                   {"while", FlowKind::kWhile},
                                   {"endwhile", FlowKind::kEndWhile},
                                   {"do", FlowKind::kDo},
                                   {"if", FlowKind::kIf},
                                   {"elseif", FlowKind::kElseIf},
                                   {"else", FlowKind::kElse},
                                   {"endif", FlowKind::kEndIf},
                                   {"repeat", FlowKind::kRepeat},
                                   {"endrepeat", FlowKind::kEndRepeat},
                                   {"break", FlowKind::kBreak},
                                   {"continue", FlowKind::kContinue}};

struct CommentName {
  std::string_view text;
  CommentKind kind;
};
constexpr CommentName kCommentNames[] = {
    {"msg,", CommentKind::kMessage},         {"debug,", CommentKind::kDebug},
    {"print,", CommentKind::kPrint},         {"log,", CommentKind::kLog},
    {"abort,", CommentKind::kAbort},         {"logopen,", CommentKind::kLogOpen},
    {"logappend,", CommentKind::kLogAppend}, {"logclose", CommentKind::kLogClose},
    {"probeopen", CommentKind::kProbeOpen},  {"probeclose", CommentKind::kProbeClose}};

bool needs_argument(FlowKind kind) {
  return kind == FlowKind::kWhile || kind == FlowKind::kIf || kind == FlowKind::kElseIf ||
         kind == FlowKind::kRepeat;
}

std::size_t most_arguments(FlowKind kind) {
  if (kind == FlowKind::kCall) return kMaxCallArguments;
  return needs_argument(kind) || kind == FlowKind::kReturn || kind == FlowKind::kEndSub ? 1 : 0;
}

// What the words are called by the first letter in the program; 0: no word begins so.
constexpr std::array<char, 256> make_word_names() {
  std::array<char, 256> names{};
  for (const char c : {'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i', 'j', 'k',
                       'l', 'm', 'p', 'q', 'r', 's', 't', 'x', 'y', 'z'})
    names[static_cast<unsigned char>(c)] = static_cast<char>(c - 32);
  names['@'] = kPolarRadius;
  names['^'] = kPolarAngle;
  return names;
}
constexpr std::array<char, 256> kWordNames = make_word_names();

// Behind the letter that comes next, white space left out: the second letter of a keyword.
bool letter_follows(const Lexer& lexer) {
  Lexer behind = lexer;
  behind.skip();
  return Lexer::is_letter(behind.peek());
}

}  // namespace

void ParsedBlock::clear() {
  words.clear();
  assignments.clear();
  code.clear();
  keywords.clear();
  keyword_columns.clear();
  flow.kind = FlowKind::kNone;
  flow.label = flow.label_expression = -1;
  flow.arguments.clear();
  comment_kind = CommentKind::kNone;
  comment.clear();
  text.clear();
  block_delete = percent = false;
}

Parser::Parser(NameTable& names, NameTable& labels, const std::vector<MappedWord>& words)
    : names_(names), labels_(labels), words_(words) {
  for (const MappedWord& word : words_)
    if (word.is_keyword()) begins_keyword_[static_cast<unsigned char>(word.text[0])] = true;
}

void Parser::line_number(Lexer& lexer) {
  const std::uint32_t column = lexer.column();
  lexer.skip();
  const char c = lexer.peek();
  if (!Lexer::is_digit(c)) fail(GcodeErrorCode::kLineNumber, column, show_byte(c));
  const double number = lexer.number();
  if (number > 999999999) fail(GcodeErrorCode::kLineNumber, column, number);
}

void Parser::parse(std::string_view text, ParsedBlock& out) {
  out.clear();
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  const std::size_t end = text.find_last_not_of(" \t\r\n");
  if (begin < text.size()) out.text = text.substr(begin, std::min(end + 1 - begin, ParsedBlock::kTextMax));
  Lexer lexer(text);
  try {
    line(lexer, out);
    // A line of another control's language fails somewhere in the middle of a word. Who reads "E is no axis"
    // of an ENDIF is not helped; the word itself is named where it is known.
  } catch (const BlockError& error) {
    refuse_slip(text, error);
    throw;
  }
}

void Parser::line(Lexer& lexer, ParsedBlock& out) {
  char c = lexer.peek();
  // What stands behind a percent sign on its line is no program.
  if (c == '%') {
    out.percent = true;
    return;
  }
  // Block delete stands in front of the line number in RS274/NGC.
  if (c == '/') {
    out.block_delete = true;
    lexer.skip();
    c = lexer.peek();
  }
  if (c == 'n') {
    line_number(lexer);
    c = lexer.peek();
  }
  const bool word = c == 'o' && begins_keyword_['o'] && letter_follows(lexer) && keyword(lexer, c, out);
  if (c == 'o' && !word) return flow(lexer, out);
  segments(lexer, out);
}

bool Parser::is_flow_line(std::string_view line) {
  Lexer lexer(line);
  lexer.accept('/');
  // Digits are enough here: a number of another form is refused when the line itself is parsed.
  if (lexer.accept('n'))
    while (Lexer::is_digit(lexer.peek())) lexer.skip();
  return lexer.peek() == 'o';
}

void Parser::parse_flow_only(std::string_view line, ParsedBlock& out) {
  if (is_flow_line(line))
    parse(line, out);
  else
    out.clear();
}

void Parser::segments(Lexer& lexer, ParsedBlock& out) {
  for (char c = lexer.peek(); c != '\0'; c = lexer.peek()) {
    const auto byte = static_cast<unsigned char>(c);
    // A keyword such as TRAORI begins with the letter of a word. The letter behind it tells the two apart,
    // since a value begins with a letter only where it is a function.
    if (begins_keyword_[byte] && letter_follows(lexer) && keyword(lexer, c, out)) continue;
    if (kWordNames[byte])
      word(lexer, kWordNames[byte], out);
    else
      other_segment(lexer, c, out);
  }
}

void Parser::other_segment(Lexer& lexer, char c, ParsedBlock& out) {
  switch (c) {
    case '(':
      return comment(lexer, out);
    case ';':
      return lexer.to_end();
    case '#':
      return assignment(lexer, out);
    case '$':
      return spindle_number(lexer);
    case 'u':
    case 'v':
    case 'w':
      fail(GcodeErrorCode::kNoSuchAxis, lexer.column(), static_cast<char>(c - 32));
    case 'n':
      fail(GcodeErrorCode::kLineNumber, lexer.column(), "in the middle of the line");
    case 'o':
      fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "not at the beginning of the line",
           "the O-word first on its line");
    // X=10 is how Sinumerik and others give a value. Here the value follows its letter at once.
    case '=':
      if (!out.words.empty())
        fail(GcodeErrorCode::kForeignEquals, lexer.column(), shown_letter(out.words.back().letter));
      [[fallthrough]];
    default:
      fail(GcodeErrorCode::kBadCharacter, lexer.column(), show_byte(c));
  }
}

// $0 and $-1: the one spindle, and all of them.
void Parser::spindle_number(Lexer& lexer) {
  const std::uint32_t column = lexer.column();
  lexer.skip();
  // $H, $J=..., $130=..., $$ and $ alone are lines that senders give to Grbl.
  const char next = lexer.peek();
  if (next == '\0' || next == '$' || Lexer::is_letter(next)) fail(GcodeErrorCode::kForeignDollar, column);
  const double number = lexer.number();
  if (lexer.peek() == '=') fail(GcodeErrorCode::kForeignDollar, column);
  if (number != 0 && number != -1) fail(GcodeErrorCode::kBadValue, column, '$', number, "a spindle", "$0");
}

void Parser::word(Lexer& lexer, char name, ParsedBlock& out) {
  if (out.words.size() == kMaxWords) fail(GcodeErrorCode::kTooManyWords, lexer.column(), kMaxWords, "words");
  ParsedWord& parsed = out.words.emplace_back();
  parsed.letter = name;
  parsed.column = lexer.column();
  lexer.skip();
  // Nearly every value is a short plain number, for which the quick way does.
  if (!lexer.short_number(parsed.value)) word_value(lexer, parsed, out);
}

// Any value but the usual number.
void Parser::word_value(Lexer& lexer, ParsedWord& parsed, ParsedBlock& out) {
  char c = lexer.peek();
  if (c == '+' || c == '-') {  // a sign before an expression negates it
    const char* mark = lexer.mark();
    lexer.skip();
    const char after = lexer.peek();
    lexer.back_to(mark);
    if (Lexer::is_digit(after) || after == '.') c = after;
  }
  if (Lexer::is_digit(c) || c == '.') {
    parsed.value = lexer.number();
    return;
  }
  if (c == '=') fail(GcodeErrorCode::kForeignEquals, lexer.column(), shown_letter(parsed.letter));
  if (c == '\0' || (c != '#' && c != '[' && c != '+' && c != '-' && !Lexer::is_letter(c)))
    fail(GcodeErrorCode::kMissingValue, parsed.column, shown_letter(parsed.letter));
  ExpressionCompiler compiler(lexer, names_, out.code);
  parsed.expression = compiler.value();
}

void Parser::assignment(Lexer& lexer, ParsedBlock& out) {
  Assignment made;
  made.column = lexer.column();
  lexer.skip();
  ExpressionCompiler compiler(lexer, names_, out.code);
  const auto start = static_cast<std::int32_t>(out.code.size());
  const ExpressionCompiler::Reference r = compiler.reference();
  made.index = r.index;
  switch (r.op) {
    case Op::kLocal:
      made.target = Assignment::Target::kLocal;
      break;
    case Op::kGlobal:
      made.target = Assignment::Target::kGlobal;
      break;
    // Found here and refused when the line is obeyed, so that a line that is never reached does no harm.
    case Op::kPredefined:
      made.target = Assignment::Target::kReadOnly;
      break;
    case Op::kNumbered:
      made.target = Assignment::Target::kNumber;
      break;
    default:
      made.target = Assignment::Target::kExpression;
      made.index = start;
      out.code.push_back(Instruction{Op::kEnd, made.column, {}});
  }
  if (!lexer.accept('=')) fail(GcodeErrorCode::kMissingEquals, lexer.column());
  made.value = compiler.value();
  out.assignments.push_back(made);
}

void Parser::comment(Lexer& lexer, ParsedBlock& out) {
  lexer.skip();
  std::string_view text = lexer.comment();
  if (text.empty()) {
    out.comment_kind = CommentKind::kIgnored;
    return;
  }
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  Lexer inner(text);
  out.comment_kind = CommentKind::kPlain;
  for (const CommentName& name : kCommentNames) {
    // "(MSG, text)" acts, "(M SG, text)" is a comment: no white space inside the word.
    if (text.size() < name.text.size() || text.find_first_of(" \t") < name.text.size() ||
        !inner.accept_word(name.text))
      continue;
    out.comment_kind = name.kind;
    break;
  }
  out.comment.assign(out.comment_kind == CommentKind::kPlain ? text : inner.rest());
}

bool Parser::keyword(Lexer& lexer, char letter, ParsedBlock& out) {
  const std::uint32_t column = lexer.column();
  // In the order of the config: a keyword that begins with another one must stand before it there.
  for (std::size_t i = 0; i < words_.size(); ++i) {
    const MappedWord& mapped = words_[i];
    if (!mapped.is_keyword() || mapped.text[0] != letter || !lexer.accept_word(mapped.text)) continue;
    if (mapped.action == WordAction::kIgnore && !lexer.rest().empty() && lexer.rest()[0] == '(') {
      lexer.skip();
      lexer.comment();  // the arguments of a cycle call
    }
    out.keywords.push_back(static_cast<std::int32_t>(i));
    out.keyword_columns.push_back(column);
    return true;
  }
  return false;
}

void Parser::flow_label(Lexer& lexer, ParsedBlock& out) {
  const char c = lexer.peek();
  if (c == '<') {
    lexer.skip();
    out.flow.label = labels_.intern(lexer.name('>'));
  } else if (Lexer::is_digit(c)) {
    const std::int64_t number = lexer.integer();
    if (lexer.peek() == '.')
      fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "the label is not an integer",
           "O and an integer, <name>, #parameter or [expression]");
    out.flow.label = labels_.intern(fmt::format("{}", number));
  } else if (c == '#' || c == '[') {
    ExpressionCompiler compiler(lexer, names_, out.code);
    out.flow.label_expression = compiler.value();
  } else {
    fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "no label",
         "O and an integer, <name>, #parameter or [expression]");
  }
}

void Parser::flow(Lexer& lexer, ParsedBlock& out) {
  out.flow.column = lexer.column();
  lexer.skip();
  flow_label(lexer, out);
  for (const FlowName& name : kFlowNames) {
    if (!lexer.accept_word(name.text)) continue;
    out.flow.kind = name.kind;
    break;
  }
  const char c = lexer.peek();
  // O1234 with nothing behind it is the number of a program, as other controls write it.
  if (out.flow.kind == FlowKind::kNone) {
    if (c != '\0' && c != '(' && c != ';')
      fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "unknown keyword",
           "sub endsub call return while endwhile do if elseif else endif repeat endrepeat break continue");
    out.flow.kind = FlowKind::kProgramNumber;
  }
  // A sub-program is looked for before its line is reached, when nothing is computed yet.
  if (out.flow.kind == FlowKind::kSub && out.flow.label < 0)
    fail(GcodeErrorCode::kFlowSyntax, out.flow.column, "the label of a sub is computed",
         "o and an integer or <name>; only the call may compute it");
  flow_arguments(lexer, out);
  for (char next = lexer.peek(); next != '\0'; next = lexer.peek()) {
    if (next == ';') return;
    if (next != '(')
      fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "more than an O-word on the line",
           "the O-word, its arguments and a comment");
    lexer.skip();
    lexer.comment();
  }
}

void Parser::flow_arguments(Lexer& lexer, ParsedBlock& out) {
  const std::size_t most = most_arguments(out.flow.kind);
  ExpressionCompiler compiler(lexer, names_, out.code);
  for (char c = lexer.peek(); c == '[' || c == '('; c = lexer.peek()) {
    if (c == '(') {
      lexer.skip();
      lexer.comment();
      continue;
    }
    if (out.flow.arguments.size() == most) fail(GcodeErrorCode::kSubArguments, lexer.column(), most);
    out.flow.arguments.push_back(compiler.bracketed());
  }
  if (needs_argument(out.flow.kind) && out.flow.arguments.empty())
    fail(GcodeErrorCode::kFlowSyntax, lexer.column(), "no condition", "[expression]");
}

}  // namespace trn
