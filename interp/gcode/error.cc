#include "interp/gcode/error.h"

#include <array>

namespace trn {

namespace {

struct Row {
  GcodeErrorCode code;
  GcodeErrorInfo info;
};
constexpr std::array<Row, static_cast<std::size_t>(GcodeErrorCode::kCount)> kErrors{{
    {GcodeErrorCode::kCannotOpen, {"cannot_open", "cannot read {}", "a readable file"}},
    {GcodeErrorCode::kNotProgram,
     {"not_program", "'{}' is no program: none of its first lines is G-code", "a text file of G-code"}},
    {GcodeErrorCode::kUtf16, {"utf16", "the file is {} text", "save it as UTF-8 or ASCII"}},
    {GcodeErrorCode::kMacLineEnds,
     {"mac_line_ends", "the lines end with CR alone, as on an old Mac",
      "LF or CR LF, which tr '\\r' '\\n' < OLD > NEW makes of them"}},
    {GcodeErrorCode::kBinary,
     {"binary", "byte 0x{:02X} is not text",
      "a program is plain text: UTF-8, ASCII, or Windows-1252 in comments"}},
    {GcodeErrorCode::kLineTooLong,
     {"line_too_long", "the line is longer than {} bytes", "split it, or raise [program] line_length_max"}},
    {GcodeErrorCode::kNoProgramEnd,
     {"no_program_end", "the file ends without M2, M30 or a closing %", "end the program with M2 or M30"}},

    {GcodeErrorCode::kLatePercent,
     {"late_percent", "'%' begins a program, and there is text before it",
      "the program's first line, with nothing but empty lines before it"}},
    {GcodeErrorCode::kBadCharacter,
     {"bad_character", "unexpected character {}", "a letter with a number, '#', '(', ';' or '/'"}},
    {GcodeErrorCode::kBadNumber,
     {"bad_number", "not a number", "digits with at most one decimal point, no exponent, below 1e15"}},
    {GcodeErrorCode::kMissingValue,
     {"missing_value", "no value after {}", "a number, #parameter, [expression] or function"}},
    {GcodeErrorCode::kUnclosedComment,
     {"unclosed_comment", "the comment is not closed", "')' on the same line"}},
    {GcodeErrorCode::kNestedComment,
     {"nested_comment", "'(' inside a comment", "comments do not nest; use [ ] or ;"}},
    {GcodeErrorCode::kMissingBracket, {"missing_bracket", "missing '{}'", "brackets come in pairs"}},
    {GcodeErrorCode::kMissingEquals, {"missing_equals", "no '=' after the parameter", "#parameter = value"}},
    {GcodeErrorCode::kBadName,
     {"bad_name", "bad parameter name", "#<name>, #number, #[expression] or ##number"}},
    {GcodeErrorCode::kBadExpression,
     {"bad_expression", "unknown operator or function {}",
      "+ - * / ** MOD EQ NE GT GE LT LE AND OR XOR; ABS ACOS ASIN ATAN COS EXISTS EXP FIX FUP LN ROUND SIN "
      "SQRT TAN"}},
    {GcodeErrorCode::kTooDeep,
     {"too_deep", "the expression is nested more than {} deep", "split it over several parameters"}},
    {GcodeErrorCode::kLineNumber,
     {"line_number", "bad line number {}", "N and an integer from 0 to 999999999, first on the line"}},

    {GcodeErrorCode::kUnknownG, {"unknown_g", "unknown G code {}", "the codes listed in docs/gcode.md"}},
    {GcodeErrorCode::kUnknownM,
     {"unknown_m", "unknown M code {}", "the codes listed in docs/gcode.md and [program] user_m"}},
    {GcodeErrorCode::kNotSupported,
     {"not_supported", "{} is not built into this control: {}", "see docs/gcode.md"}},
    {GcodeErrorCode::kGroupConflict,
     {"group_conflict", "{} and {} are of one modal group", "one of them a line"}},
    {GcodeErrorCode::kRepeatedWord, {"repeated_word", "the word {} is given twice", "once a line"}},
    {GcodeErrorCode::kTooManyWords, {"too_many_words", "more than {} {} on one line", "split the line"}},
    {GcodeErrorCode::kUnusedWord, {"unused_word", "nothing on this line uses the word {}: {}", ""}},
    {GcodeErrorCode::kMissingWord, {"missing_word", "{} needs {}", "add the word"}},
    {GcodeErrorCode::kBadValue, {"bad_value", "{} = {} is not legal for {}: {}", ""}},
    {GcodeErrorCode::kNoSuchAxis, {"no_such_axis", "this machine has no {} axis", "the axes of the config"}},

    {GcodeErrorCode::kUnknownParameter,
     {"unknown_parameter", "parameter {} has no value yet", "assign it first, or ask EXISTS[#<name>]"}},
    {GcodeErrorCode::kReadOnlyParameter,
     {"read_only_parameter", "parameter {} is read-only", "assign another one"}},
    {GcodeErrorCode::kParameterRange,
     {"parameter_range", "there is no parameter number {}", "an integer from 1 to 5601"}},
    {GcodeErrorCode::kDivideByZero, {"divide_by_zero", "division by zero", "a divisor other than 0"}},
    {GcodeErrorCode::kDomain,
     {"domain", "{} of {} is not defined", "an argument inside the function's range"}},
    {GcodeErrorCode::kNotInteger, {"not_integer", "{} = {} is not an integer", "an integer"}},

    {GcodeErrorCode::kNoMotionMode,
     {"no_motion_mode", "axis words without a motion mode",
      "G0, G1, G2, G3 or a cycle before or on this line"}},
    {GcodeErrorCode::kMachineMove, {"machine_move", "G53 {}", "G90, then G53 with G0 or G1 and axis words"}},
    {GcodeErrorCode::kAxisWordsUnused,
     {"axis_words_unused", "{} takes no axis words", "axis words on a line of their own"}},
    {GcodeErrorCode::kAxisWordsConflict,
     {"axis_words_conflict", "{} and {} both want the axis words", "two lines"}},
    {GcodeErrorCode::kZeroFeed, {"zero_feed", "{} with feed rate 0", "an F word before or on this line"}},
    {GcodeErrorCode::kFeedModeCycle, {"feed_mode_cycle", "{} cannot run in feed mode {}", "G94"}},
    {GcodeErrorCode::kInverseFeedMissing,
     {"inverse_feed_missing", "{} in G93 needs an F word on its own line",
      "F in moves per minute, greater than 0"}},
    {GcodeErrorCode::kNoSpindle, {"no_spindle", "{} needs a turning spindle", "S and M3 or M4 first"}},
    {GcodeErrorCode::kSpindleDirection,
     {"spindle_direction", "{} needs a spindle that turns {}, and it turns {}",
      "M3 before G84, M4 before G74"}},

    {GcodeErrorCode::kArcNoRadius,
     {"arc_no_radius", "the radius of the arc is 0: it begins at its centre",
      "I, J or K, the way from the start to the centre"}},
    {GcodeErrorCode::kArcRadius,
     {"arc_radius", "radius {:.4f} cannot span the distance {:.4f} to the end point",
      "a radius of at least half the distance"}},
    {GcodeErrorCode::kArcGap,
     {"arc_gap", "the arc's end misses its circle by {:.4f} (radius {:.4f} at the start, {:.4f} at the end)",
      "a gap of at most [program] arc_tolerance_mm"}},
    {GcodeErrorCode::kArcSamePoint,
     {"arc_same_point", "an arc by R that ends where it starts has no centre",
      "I, J or K for a full circle"}},
    {GcodeErrorCode::kArcMissing, {"arc_missing", "the arc in plane {} has neither {}", "centre words or R"}},
    {GcodeErrorCode::kPlane, {"plane", "{} is not possible in plane {}: use {}", ""}},
    {GcodeErrorCode::kCycle, {"cycle", "{}: {}", ""}},
    {GcodeErrorCode::kProbe, {"probe", "the probe move {}", "a straight move that is not zero"}},
    {GcodeErrorCode::kSpline, {"spline", "{}: {}", ""}},

    {GcodeErrorCode::kUnknownTool,
     {"unknown_tool", "tool {} is not in {}",
      "a tool of the table; 'trunnion tool' adds one at the machine, --tools FILE.tbl gives another table"}},
    {GcodeErrorCode::kNoToolTable,
     {"no_tool_table", "tool {} is not known: no tool table was given",
      "--tools FILE.tbl, with this tool in it"}},
    {GcodeErrorCode::kCompState,
     {"comp_state", "{} is not possible while cutter compensation is on", "G40 first"}},
    {GcodeErrorCode::kCompGouge,
     {"comp_gouge",
      "the tool of radius {:.4f} would gouge: the move of line {} does not fit beside that of line {}",
      "a smaller tool or a wider corner; or [program] gouge_check"}},
    {GcodeErrorCode::kCompCorner, {"comp_corner", "cutter compensation: {}: {}", ""}},

    {GcodeErrorCode::kNoRtcp,
     {"no_rtcp", "{}: this machine has no tool-centre-point control", "a machine with rotary axes"}},
    {GcodeErrorCode::kRtcpState, {"rtcp_state", "{}: {}", ""}},
    {GcodeErrorCode::kUnreachable,
     {"unreachable", "{}: the machine cannot take this pose ({})", "a pose inside the working space"}},
    {GcodeErrorCode::kTiltedPlane, {"tilted_plane", "{}: {}", ""}},
    {GcodeErrorCode::kKnife,
     {"tangential_knife", "{} is not possible while the knife follows the path{}", "TANGOF first"}},
    {GcodeErrorCode::kKnifeStart, {"tangential_knife_start", "{}: {}", ""}},
    {GcodeErrorCode::kSpindleAxis, {"spindle_axis", "{}: {}", ""}},

    {GcodeErrorCode::kFlowSyntax, {"flow_syntax", "bad O-word: {}: {}", ""}},
    {GcodeErrorCode::kFlowUnmatched,
     {"flow_unmatched", "{} without {}", "O-words come in pairs with one label"}},
    {GcodeErrorCode::kFlowNoEnd, {"flow_no_end", "no {} for {} of line {}", "close it in the same file"}},
    {GcodeErrorCode::kNextProgram,
     {"next_program", "another program begins here, and the one before it has not ended",
      "M30 or M99 at the end of every program"}},
    {GcodeErrorCode::kSubUnknown,
     {"sub_unknown", "there is no sub-program {}",
      "define it in the file, or as a file on the sub-program path"}},
    {GcodeErrorCode::kSubDepth,
     {"sub_depth", "sub-programs nested more than {} deep", "no endless recursion"}},
    {GcodeErrorCode::kSubArguments, {"sub_arguments", "more than {} arguments", "pass fewer"}},
    {GcodeErrorCode::kSubRepeated,
     {"sub_repeated", "sub-program {} is defined twice, first in line {}", "one definition a file"}},
    {GcodeErrorCode::kNotSeekable,
     {"not_seekable", "the input cannot be read again for {}", "a file instead of a pipe"}},
    {GcodeErrorCode::kFromLine,
     {"from_line", "the program cannot begin at line {}: {}", "a line of the main program that is reached"}},
    {GcodeErrorCode::kAbort,
     {"abort", "the program aborts itself: {}", "see the ABORT comment of the program"}},
    {GcodeErrorCode::kPolar,
     {"polar", "the polar coordinate @ or ^ {}", "@ and ^ with G0, G1, an arc or a cycle, without X and Y"}},
    {GcodeErrorCode::kForeignBranch,
     {"foreign_branch", "IF and THEN are other controls' words",
      "o100 if [#1 eq 2], o100 else and o100 endif, each on a line of its own"}},
    {GcodeErrorCode::kForeignLoop,
     {"foreign_loop", "WHILE, DO, FOR, LOOP and their ends are other controls' words",
      "o100 while [#1 lt 5] and o100 endwhile, or o100 repeat [5] and o100 endrepeat"}},
    {GcodeErrorCode::kForeignJump,
     {"foreign_jump", "GOTO and its kind are other controls' words, and there are no jumps",
      "o100 if, o100 while, o100 break, or a sub-program"}},
    {GcodeErrorCode::kForeignEquals,
     {"foreign_equals", "'=' behind {} is another control's form", "X10 for X=10, #1=5 for R1=5"}},
    {GcodeErrorCode::kForeignDollar,
     {"foreign_dollar", "'$' begins a command to another control and no word of a program",
      "$0 for the spindle; 'trunnion home', 'trunnion reset' and 'trunnion jog' do what $H, $X and $J= do"}},
    {GcodeErrorCode::kForeignCode,
     {"foreign_code", "{} is a code of other controls; here {}", "what docs/gcode.md lists"}},
    {GcodeErrorCode::kForeignWord,
     {"foreign_word", "this is no word of this language",
      "a letter with a number, as X10; a word that means nothing here may stand in [program] ignored"}},
}};

// A row that is missing or in a wrong place would give every error behind it another's text.
constexpr bool in_order() {
  for (std::size_t i = 0; i < kErrors.size(); ++i)
    if (kErrors[i].code != static_cast<GcodeErrorCode>(i) || kErrors[i].info.name.empty()) return false;
  return true;
}
static_assert(in_order());

}  // namespace

const GcodeErrorInfo& gcode_error_info(GcodeErrorCode code) {
  return kErrors[static_cast<std::size_t>(code)].info;
}

}  // namespace trn
