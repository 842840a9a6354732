#include <fmt/format.h>

#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/expression.h"
#include "interp/gcode/text/lexer.h"

// Comments that say something: (MSG, ...), (DEBUG, ...), (PRINT, ...), (PROBEOPEN ...).
namespace trn {

void Executor::comment(const Block& b) {
  const std::string& text = b.parsed->comment;
  switch (b.parsed->comment_kind) {
    case CommentKind::kPlain:
      put(canon::Comment{text});
      break;
    case CommentKind::kMessage:
      put_now(canon::Message{text});
      break;
    case CommentKind::kDebug:
      if (parts_.parameters[parameter::kDebugOutput] > 0) put_now(canon::Message{expand_message(text)});
      break;
    case CommentKind::kPrint:
      put_now(canon::Print{expand_message(text)});
      break;
    case CommentKind::kLog:
      put_now(canon::Log{canon::Log::What::kLine, expand_message(text)});
      break;
    case CommentKind::kLogOpen:
      put_now(canon::Log{canon::Log::What::kOpen, text});
      break;
    case CommentKind::kLogAppend:
      put_now(canon::Log{canon::Log::What::kAppend, text});
      break;
    case CommentKind::kLogClose:
      put_now(canon::Log{canon::Log::What::kClose, ""});
      break;
    case CommentKind::kProbeOpen:
      put_now(canon::Log{canon::Log::What::kProbeOpen, text});
      break;
    case CommentKind::kProbeClose:
      put_now(canon::Log{canon::Log::What::kProbeClose, ""});
      break;
    case CommentKind::kAbort:
      fail(GcodeErrorCode::kAbort, 1, expand_message(text));
    default:
      break;
  }
}

// #parameters in a message become their values, with six decimals; %d, %f (four) and %.Nf set how the
// following ones are written.
std::string Executor::expand_message(const std::string& text) const {
  std::string out;
  int digits = 6;
  Lexer lexer(text);
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    if (*p == '%' && p + 1 != end) {
      if (p[1] == 'd' || p[1] == 'f') {
        digits = p[1] == 'd' ? 0 : 4;
        p += 2;
        continue;
      }
      if (p[1] == '.' && end - p > 3 && Lexer::is_digit(p[2]) && p[3] == 'f') {
        digits = p[2] - '0';
        p += 4;
        continue;
      }
    }
    if (*p == '#') {
      lexer.back_to(p + 1);
      try {
        std::vector<Instruction> code;
        ExpressionCompiler compiler(lexer, parts_.parameters.names(), code);
        const ExpressionCompiler::Reference r = compiler.reference();
        Instruction last{r.op, 1, {}};
        if (r.op != Op::kIndirect) last.index = r.index;
        code.push_back(last);
        code.push_back(Instruction{Op::kEnd, 1, {}});
        out += fmt::format("{:.{}f}", Evaluator(parts_.parameters, *this).run(code, 0), digits);
        const char* const start = p;
        for (p = lexer.mark(); p > start && (p[-1] == ' ' || p[-1] == '\t');) --p;
        continue;
      } catch (const BlockError& error) {  // not a parameter: shown as it is written
        if (error.code == GcodeErrorCode::kUnknownParameter) {
          out += "######";
          p = lexer.mark();
          continue;
        }
      }
    }
    out += *p++;
  }
  return out;
}

}  // namespace trn
