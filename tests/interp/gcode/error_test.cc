#include "interp/gcode/error.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "interp/gcode/canon.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/line_reader.h"
#include "interp/gcode/tool_table.h"
#include "tests/interp/gcode/run_program.h"

// Every class of error once, with its exact message.
namespace trn {
namespace {

using test::Session;

struct Case {
  const char* program;
  const char* message;
};

const Case kCases[] = {
    {"G0 X1 ~",
     "p.ngc:1:7: unexpected character '~': '~'; legal: a letter with a number, '#', '(', ';' or '/'"},
    {"G0 X1000000000000000",
     "p.ngc:1:5: not a number: '1000000000000000'; legal: digits with at most one decimal point, no "
     "exponent, "
     "below 1e15"},
    {"o1 endif", "p.ngc:1:1: endif without if: 'o1'; legal: O-words come in pairs with one label"},
    {"F1 S1 M3 G76 P1 Z1", "p.ngc:1:10: G76 needs a word I: 'G76'; legal: add the word"},
    {"G0 @5 X1",
     "p.ngc:1:7: the polar coordinate @ or ^ goes with a word X: 'X1'; legal: @ and ^ with G0, G1, an arc or "
     "a "
     "cycle, without X and Y"},
    {"G0 @5",
     "p.ngc:1:4: the polar coordinate @ or ^ stands at the origin without ^: '@5'; legal: @ and ^ with "
     "G0, G1, an arc or a cycle, without X and Y"},
    {"G0 X1.2.3",
     "p.ngc:1:5: not a number: '1.2.3'; legal: digits with at most one decimal point, no exponent, below "
     "1e15"},
    {"G0 X", "p.ngc:1:4: no value after X: 'X'; legal: a number, #parameter, [expression] or function"},
    {"G0 (no end", "p.ngc:1:4: the comment is not closed: '(no'; legal: ')' on the same line"},
    {"(a (b) c)", "p.ngc:1:4: '(' inside a comment: '(b)'; legal: comments do not nest; use [ ] or ;"},
    {"G0 X[1+2", "p.ngc:1:9: missing ']'; legal: brackets come in pairs"},
    {"#1 X5", "p.ngc:1:4: no '=' after the parameter: 'X5'; legal: #parameter = value"},
    {"G0 X#", "p.ngc:1:6: bad parameter name; legal: #<name>, #number, #[expression] or ##number"},
    {"G0 N5",
     "p.ngc:1:4: bad line number in the middle of the line: 'N5'; legal: N and an integer from 0 to "
     "999999999, "
     "first on the line"},
    {"G99.5",
     "p.ngc:1:1: unknown G code G99.5: 'G99.5'; legal: the codes listed in docs/gcode.md; [program] ignored "
     "passes over others"},
    {"M123",
     "p.ngc:1:1: unknown M code M123: 'M123'; legal: the codes listed in docs/gcode.md; [[program.m_code]] "
     "gives others a meaning, [program] ignored passes over them"},
    {"G0 G1 X1", "p.ngc:1:4: G0 and G1 are of one modal group: 'G1'; legal: one of them a line"},
    {"G0 X1 X2", "p.ngc:1:7: the word X is given twice: 'X2'; legal: once a line"},
    {"M3 M7 M48 M62 P1 M66 P1", "p.ngc:1:18: more than 4 M codes on one line: 'M66'; legal: split the line"},
    {"G0 X1 $1", "p.ngc:1:7: $ = 1 is not legal for a spindle: $0: '$1'"},
    {"G91 G0 @5 ^3",
     "p.ngc:1:8: the polar coordinate @ or ^ stands at the origin in G91: '@5'; legal: @ and ^ with G0, G1, "
     "an arc or a cycle, without X and Y"},
    {"o1 sub\no1 endsub\no1 sub\no1 endsub",
     "p.ngc:3:1: sub-program o1 is defined twice, first in line 1: 'o1'; legal: one definition a file"},
    {"G0 X1 H2",
     "p.ngc:1:7: nothing on this line uses the word H: G43, G43.2, G43.4, G43.5 or G183 uses H: 'H2'"},
    {"G4", "p.ngc:1:1: G4 needs a P word, seconds: 'G4'; legal: add the word"},
    {"G4 P-1", "p.ngc:1:4: P = -1 is not legal for G4: P of 0 or more seconds: 'P-1'"},
    {"G0 U1", "p.ngc:1:4: this machine has no U axis: 'U1'; legal: the axes of the config"},
    {"G0 X#<depth>",
     "p.ngc:1:5: parameter #<depth> has no value yet: '#<depth>'; legal: assign it first, or ask "
     "EXISTS[#<name>]"},
    {"#5400 = 1", "p.ngc:1:1: parameter #5400 is read-only: '#5400'; legal: assign another one"},
    {"#<_x> = 1", "p.ngc:1:1: parameter #<_x> is read-only: '#<_x>'; legal: assign another one"},
    {"#6000 = 1", "p.ngc:1:2: there is no parameter number 6000: '6000'; legal: an integer from 1 to 5601"},
    {"G0 X[1/0]", "p.ngc:1:7: division by zero: '/0]'; legal: a divisor other than 0"},
    {"G0 X[SQRT[-4]]",
     "p.ngc:1:6: SQRT of -4 is not defined: 'SQRT[-4]]'; legal: an argument inside the function's range"},
    {"F9 G2 I5 P0", "p.ngc:1:10: P = 0 is not legal for an arc: 1 turn to 1000000: 'P0'"},
    {"F9 G2 I5\nI5 P0", "p.ngc:2:4: P = 0 is not legal for an arc: 1 turn to 1000000: 'P0'"},
    {"F9 G3 I5\nI5 P-1 (modal)", "p.ngc:2:4: P = -1 is not legal for an arc: 1 turn to 1000000: 'P-1'"},
    {"F9 G2 I5\nI5 P1.5", "p.ngc:2:4: P = 1.5 is not an integer: 'P1.5'; legal: an integer"},
    {"F9 G2 I5\nI5 P1000001",
     "p.ngc:2:4: P = 1000001 is not legal for an arc: 1 turn to 1000000: 'P1000001'"},
    {"T1.5", "p.ngc:1:1: T = 1.5 is not an integer: 'T1.5'; legal: an integer"},
    {"X1",
     "p.ngc:1:1: axis words without a motion mode: 'X1'; legal: G0, G1, G2, G3 or a cycle before or on this "
     "line"},
    {"G80 X1", "p.ngc:1:1: G80 takes no axis words: 'G80'; legal: axis words on a line of their own"},
    {"G1 G92 X1 F1",
     "p.ngc:1:1: G1 and another code of the line both want the axis words: 'G1'; legal: two lines"},
    {"G1 X1", "p.ngc:1:1: G1 with feed rate 0: 'G1'; legal: an F word before or on this line"},
    {"G93\nG81 Z-1 R1 F1", "p.ngc:2:1: G81 cannot run in feed mode G93: 'G81'; legal: G94"},
    {"G93 G1 X1",
     "p.ngc:1:5: G1 in G93 needs an F word on its own line: 'G1'; legal: F in moves per minute, greater than "
     "0"},
    {"F9 S9 M4 G84 Z-1 R1",
     "p.ngc:1:10: G84 needs a spindle that turns clockwise, and it turns counterclockwise: 'G84'; legal: M3 "
     "before G84, M4 before G74"},
    {"F9 S9 M3 G74 Z-1 R1",
     "p.ngc:1:10: G74 needs a spindle that turns counterclockwise, and it turns clockwise: 'G74'; legal: M3 "
     "before G84, M4 before G74"},
    {"S500 M3\nG33 Z-10 K0",
     "p.ngc:2:10: K = 0 is not legal for G33: the way of a turn, greater than 0: 'K0'"},
    {"S500 M3\nG33.1 Z-10 K-1",
     "p.ngc:2:12: K = -1 is not legal for G33.1: the way of a turn, greater than 0: 'K-1'"},
    {"G3 I0 J0 F100",
     "p.ngc:1:1: the radius of the arc is 0: it begins at its centre: 'G3'; legal: I, J or K, the way from "
     "the start to the centre"},
    {"G91 G53 G0 X5",
     "p.ngc:1:5: G53 names a place of the machine, which no word of G91 can do: 'G53'; legal: G90, then G53 "
     "with G0 or G1 and axis words"},
    {"G53 G38.2 Z0 F100",
     "p.ngc:1:1: G53 goes with G0 and G1, and not with G38.2: 'G53'; legal: G90, then G53 with G0 or G1 and "
     "axis words"},
    {"G53", "p.ngc:1:1: G53 needs G0 or G1 and axis words: 'G53'; legal: add the word"},
    {"G65 P1234 A1",
     "p.ngc:1:1: G65 is a code of other controls; here o1234 call [1] [2] calls a sub-program with "
     "arguments: 'G65'; legal: what docs/gcode.md lists"},
    {"G0 X1\n%",
     "p.ngc:2:1: '%' begins a program, and there is text before it: '%'; legal: the program's "
     "first line, with nothing but empty lines before it"},
    {"F9 G84 Z-1 R1", "p.ngc:1:4: G84 (M3) needs a turning spindle: 'G84'; legal: S and M3 or M4 first"},
    {"F9 G2 X10 R1",
     "p.ngc:1:11: radius 1.0000 cannot span the distance 10.0000 to the end point: 'R1'; legal: a radius of "
     "at least half the distance"},
    {"F9 G2 X10 I6",
     "p.ngc:1:4: the arc's end misses its circle by 2.0000 (radius 6.0000 at the start, 4.0000 at the end): "
     "'G2'; legal: a gap of at most [program] arc_tolerance_mm"},
    {"F9 G2 R1",
     "p.ngc:1:7: an arc by R that ends where it starts has no centre: 'R1'; legal: I, J or K for a full "
     "circle"},
    {"F9 G2 X1", "p.ngc:1:4: the arc in plane G17 has neither R nor I nor J: 'G2'; legal: centre words or R"},
    {"F9 G2 X1 K1", "p.ngc:1:10: K is not possible in plane G17: use I and J: 'K1'"},
    {"F9 G81 Z1 R0", "p.ngc:1:4: G81: R 0.0000 lies below the bottom 1.0000: R above the bottom: 'G81'"},
    {"F9 G38.2 X0",
     "p.ngc:1:4: the probe move ends where it starts: 'G38.2'; legal: a straight move that is not zero"},
    {"G5.3", "p.ngc:1:1: G5.3 without G5.2: G5.2 first: 'G5.3'"},
    {"T9",
     "p.ngc:1:1: tool 9 is not in t.tbl: 'T9'; legal: a tool of the table; 'trunnion tool' adds one at the "
     "machine, --tools FILE.tbl gives another table"},
    {"O1\nG0 X1\nO2",
     "p.ngc:3:1: another program begins here, and the one before it has not ended: 'O2'; legal: M30 or M99 "
     "at "
     "the end of every program"},
    {"IF [#1 EQ 2] GOTO 5",
     "p.ngc:1:1: IF and THEN are other controls' words: 'IF'; legal: o100 if [#1 eq 2], o100 else and o100 "
     "endif, each on a line of its own"},
    {"G0 X1\nWHILE [#1 LT 5] DO1",
     "p.ngc:2:1: WHILE, DO, FOR, LOOP and their ends are other controls' words: 'WHILE'; legal: o100 while "
     "[#1 lt 5] and o100 "
     "endwhile, or o100 repeat [5] and o100 endrepeat"},
    {"N5 GOTO 10",
     "p.ngc:1:4: GOTO and its kind are other controls' words, and there are no jumps: 'GOTO'; legal: o100 "
     "if, o100 while, "
     "o100 break, or a sub-program"},
    {"G1 X=5", "p.ngc:1:5: '=' behind X is another control's form: '=5'; legal: X10 for X=10, #1=5 for R1=5"},
    {"G21\n$H",
     "p.ngc:2:1: '$' begins a command to another control and no word of a program: '$H'; legal: $0 for the "
     "spindle; 'trunnion home', 'trunnion reset' and 'trunnion jog' do what $H, $X and $J= do"},
    {"#1=5\n#2=#1 + 3",
     "p.ngc:2:7: + stands outside brackets: '+'; legal: [#1 + 2] for #1 + 2, X[5 - 3] for X5-3"},
    {"G1 F9 X1,5", "p.ngc:1:9: a comma is no decimal point: ',5'; legal: X1.5 for X1,5"},
    {"G1 F9 X5 ,R2",
     "p.ngc:1:10: ',R' breaks a corner on other controls, and not here: ',R2'; legal: the chamfer as a G1, "
     "the "
     "rounding as a G2 or G3"},
    {"G0 X\u22125",
     "p.ngc:1:5: U+2212 looks like '-' and is another character: '\u22125'; legal: the character of an "
     "English "
     "keyboard"},
    {"G0 X1 SUPA",
     "p.ngc:1:7: this is no word of this language: 'SUPA'; legal: a letter with a number, as X10; a word "
     "that "
     "means nothing here may stand in [program] ignored"},
    {"G41.1 D2\nG41.1 D2",
     "p.ngc:2:1: G41.1 is not possible while cutter compensation is on: 'G41.1'; legal: G40 first"},
    {"F9 G41.1 D10\nG1 X20\nX21\nX22 Y50\nX0 Y60", nullptr},
    {"F9 G41.1 D10\nG1 X2",
     "p.ngc:2:1: cutter compensation: the entry move is 2.0000 long, the tool's radius 5.0000: a "
     "straight move longer than the tool's radius: 'G1'"},
    {"G43.4 H1",
     "p.ngc:1:1: G43.4: this machine has no tool-centre-point control: 'G43.4'; legal: a machine with rotary "
     "axes"},
    {"o1 jump",
     "p.ngc:1:4: bad O-word: unknown keyword: sub endsub call return while endwhile do if elseif else endif "
     "repeat endrepeat break continue: 'jump'"},
    {"o1 endwhile", "p.ngc:1:1: endwhile without while: 'o1'; legal: O-words come in pairs with one label"},
    {"o1 if [0]\nG0 X1", "p.ngc:4:1: no endif for o1 of line 1; legal: close it in the same file"},
    {"o9 call",
     "p.ngc:1:1: there is no sub-program o9: 'o9'; legal: define it in the file, or as a file on the "
     "sub-program "
     "path"},
    {"o1 sub\no1 endsub\no1 sub\no1 endsub\no2 call", nullptr},
    {"(ABORT, broken #1)",
     "p.ngc:1:1: the program aborts itself:  broken 0.000000: '(ABORT,'; legal: see the ABORT comment "
     "of the program"},
    {"G53 X1",
     "p.ngc:1:5: axis words without a motion mode: 'X1'; legal: G0, G1, G2, G3 or a cycle before or on this "
     "line"},
};

std::set<GcodeErrorCode> code_of(const std::string& program, Session session = Session()) {
  test::CanonText sink;
  try {
    session.run(program, sink);
  } catch (const GcodeError& error) {
    return {error.code};
  }
  return {};
}

TEST(Errors, EachClassHasItsSentence) {
  for (const Case& c : kCases) {
    const std::string message = Session().error(c.program);
    if (c.message)
      EXPECT_EQ(message, c.message) << c.program;
    else
      EXPECT_NE(message, "") << c.program;
  }
}

// Input that can be read once only, as from a pipe.
class OneWay : public ByteSource {
 public:
  explicit OneWay(std::string text) : text_(std::move(text)) {}
  std::size_t read(char* to, std::size_t size) override {
    const std::size_t count = std::min(size, text_.size() - at_);
    std::copy_n(text_.data() + at_, count, to);
    at_ += count;
    return count;
  }
  bool seek(std::uint64_t) override { return false; }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

// What only a session without tools, with a guard at its files, or with a strict config refuses.
std::set<GcodeErrorCode> codes_of_sessions() {
  std::set<GcodeErrorCode> reached;
  Session none;
  none.tools = ToolTable();
  reached.merge(code_of("G43 H7\n", none));
  Session guarded;  // whoever opens files for the daemon takes programs only
  guarded.config.open = [](const std::string& path, bool) -> std::unique_ptr<ByteSource> {
    fail(GcodeErrorCode::kNotProgram, 0, path);
  };
  try {
    test::CanonText sink;
    Interpreter interpreter({guarded.config, guarded.parameters, guarded.tools, nullptr, sink, {}});
    interpreter.open("secrets");
  } catch (const GcodeError& error) {
    EXPECT_STREQ(error.what(),
                 "'secrets' is no program: none of its first lines is G-code; legal: a text file of G-code");
    reached.insert(error.code);
  }
  Session strict;
  strict.config.end = ProgramEnd::kRequired;
  reached.merge(code_of("G0 X1\n", strict));
  return reached;
}

// No class of error is without a program that brings it about.
TEST(Errors, EveryClassIsReached) {
  using Code = GcodeErrorCode;
  const std::string deep(150, '['), tilted = "G68.2 X0 Y0 Z0 I0 J10 K0\n";
  const Session five = test::cradle();
  std::set<Code> reached;
  for (const Case& c : kCases) reached.merge(code_of(std::string(c.program) + "\nM2\n"));
  for (const std::string& program :
       {std::string("\xFF\xFEG"), std::string("G0 X1\0", 6), std::string(70000, ' '), std::string("G0 X1\n"),
        std::string("G0 X1\rM2\r"), std::string("G0 X[1 FOO 2]"), "#1=" + deep, std::string("#<a=1"),
        std::string("#[1=1"),
        std::string("o1 call [1] [2] [3] [4] [5] [6] [7] [8] [9] [1] [2] [3] [4] [5] [6] [7] [8] [9] [1] [2] "
                    "[3] [4] [5] "
                    "[6] [7] [8] [9] [1] [2] [3] [4]"),
        std::string("o1 sub\no1 call\no1 endsub\no1 call\nM2\n"),
        std::string("o1 sub\no1 endsub\no1 sub\no1 endsub\no2 call\n"),
        std::string("F9 G41.1 D10\nG1 X20\nX21\nX22 Y50\nX0 Y60\n")})
    reached.merge(code_of(program));
  for (const std::string& program : {std::string("G43.5\nG1 F9 I0 J0 K0\n"), tilted + tilted,
                                     std::string("T1 M6\nG43.5\nG1 F9 I1 J0 K-1\n")})
    reached.merge(code_of(program, five));
  reached.merge(code_of("G0 X9000 Y9000 Z9000\nG43.4 H1\n", test::shipped("rail_mill")));
  reached.merge(code_of("TANGON\nG0 C5\n", test::shipped("tangential_knife")));
  reached.merge(code_of("G93\nTANGON\n", test::shipped("tangential_knife")));
  reached.merge(code_of("G0 C5\n", test::shipped("spindle_axis")));
  reached.merge(codes_of_sessions());
  try {
    Session s;
    test::CanonText sink;
    Interpreter interpreter({s.config, s.parameters, s.tools, nullptr, sink, {}});
    interpreter.open("/no/such/file.ngc");
  } catch (const GcodeError& error) {
    EXPECT_STREQ(error.what(),
                 "cannot read '/no/such/file.ngc': No such file or directory; legal: a readable file");
    reached.insert(error.code);
  }
  try {
    Session s;
    test::CanonText sink;
    Interpreter interpreter({s.config, s.parameters, s.tools, nullptr, sink, {}});
    interpreter.open_text("G0 X1\nM2\n", "p.ngc");
    interpreter.begin_at(9, {});
  } catch (const GcodeError& error) {
    EXPECT_EQ(std::string(error.what()).substr(0, 53),
              "p.ngc:9: the program ends before this line is reached");
    reached.insert(error.code);
  }
  try {
    Session().moves("M66 P1 L0\n");
  } catch (const GcodeError& error) {
    reached.insert(error.code);
  }
  try {
    LineReader reader(std::make_unique<OneWay>(std::string(1 << 20, '\n')), 100);
    std::string_view line;
    while (reader.next(line)) {
    }
    EXPECT_FALSE(reader.seek({0, 1}));
    reached.insert(Code::kNotSeekable);
  } catch (const BlockError&) {
    ADD_FAILURE();
  }
  for (int code = 0; code < static_cast<int>(Code::kCount); ++code)
    EXPECT_TRUE(reached.count(static_cast<Code>(code))) << gcode_error_info(static_cast<Code>(code)).name;
}

TEST(Errors, GougeNamesBothLines) {
  const std::string message = Session().error("F9 G41.1 D10\nG1 X20\nX30\nX31 Y1\nX31 Y50\nG40 X0");
  EXPECT_NE(message.find("would gouge: the move of line"), std::string::npos) << message;
}

TEST(Errors, StackShowsEveryCaller) {
  const std::string message =
      Session().error("o1 sub\nG0 X[1/#7]\no1 endsub\no2 sub\no1 call\no2 endsub\no2 call");
  EXPECT_EQ(message,
            "p.ngc:2:7: division by zero: '/#7]'; legal: a divisor other than 0\n"
            "  o1 called from p.ngc:5\n  o2 called from p.ngc:7");
}

TEST(Errors, EndlessRecursionIsRefused) {
  const std::string message = Session().error("o1 sub\no1 call\no1 endsub\no1 call");
  EXPECT_EQ(message.substr(0, message.find('\n')),
            "p.ngc:2:1: sub-programs nested more than 50 deep: 'o1'; legal: no endless recursion");
  const auto lines = std::count(message.begin(), message.end(), '\n');
  EXPECT_EQ(lines, 4) << message;
  EXPECT_TRUE(message.ends_with("\n  o1 called from p.ngc:2\n  ... and 47 more calls")) << message;
}

TEST(Errors, MissingEndOfProgram) {
  Session session;
  test::CanonText sink;
  session.config.end = ProgramEnd::kRequired;
  EXPECT_THROW(session.run("G0 X1\n", sink), GcodeError);
  session.config.end = ProgramEnd::kFree;
  EXPECT_NO_THROW(session.run("G0 X1\n", sink));
  EXPECT_NO_THROW(Session().run("%\nG0 X1\n%\nthis is not read\n", sink));
}

TEST(Errors, EncodingsAreNamed) {
  using namespace std::string_literals;
  EXPECT_EQ(Session().error("\xFF\xFEG\0000\0\n\0"s),
            "p.ngc:1:1: the file is UTF-16LE text; legal: save it as UTF-8 or ASCII");
  EXPECT_EQ(Session().error("\xFE\xFF\0G\0000"s),
            "p.ngc:1:1: the file is UTF-16BE text; legal: save it as UTF-8 or ASCII");
  EXPECT_EQ(Session().error("G\0000\0 \0X\0001\0"s),
            "p.ngc:1:1: the file is UTF-16LE text; legal: save it as UTF-8 or ASCII");
  EXPECT_EQ(Session().error("G0 X1\0Y2"s).substr(0, 33), "p.ngc:1:6: byte 0x00 is not text;");
  EXPECT_EQ(Session().error("\xEF\xBB\xBFG0 X1\r\n(caf\xE9, \xC3\xBC)\r\nG0 X2 ; \xB0\r\n"), "");
  EXPECT_EQ(Session().error("G0 X\xB0").substr(0, 11), "p.ngc:1:4: ");
  for (const char* mac : {"%\rG0 X1\rM2\r", "G0 X1\r(comment)\rM2"}) {
    Session s;
    test::CanonText sink;
    try {
      s.run(mac, sink);
      ADD_FAILURE() << mac;
    } catch (const GcodeError& error) {
      EXPECT_EQ(error.code, GcodeErrorCode::kMacLineEnds) << error.what();
    }
  }
}

// What is well known of other controls is answered with what does the same here.
TEST(Errors, CodesOfOtherControlsGetAdvice) {
  for (const auto& [code, advice] : {std::pair("G65", "call"),
                                     std::pair("G66", "call"),
                                     std::pair("G68", "G10 L2"),
                                     std::pair("G51", "expressions"),
                                     std::pair("G50", "nothing that it could end"),
                                     std::pair("G15", "nothing that it could end"),
                                     std::pair("G16", "@ and ^"),
                                     std::pair("G54.1", "G59.1"),
                                     std::pair("G70", "lathe"),
                                     std::pair("G71", "lathe"),
                                     std::pair("G72", "lathe"),
                                     std::pair("G32", "G33 Z K"),
                                     std::pair("M97", "M98 P"),
                                     std::pair("M29", "G33.1"),
                                     std::pair("G12", "no cycle for a pocket"),
                                     std::pair("G31", "G38.2"),
                                     std::pair("G9", "G61.1"),
                                     std::pair("G187", "G64 P0.02"),
                                     std::pair("G154", "G59.1"),
                                     std::pair("G642", "G64 P0.02"),
                                     std::pair("G44", "G43.1 Z"),
                                     std::pair("G234", "G43.4 H1"),
                                     std::pair("M17", "endsub"),
                                     std::pair("M117", "(MSG, text)")}) {
    const std::string error = Session().error(std::string(code) + "\n");
    EXPECT_EQ(error.find(std::string("p.ngc:1:1: ") + code + " is a code of other controls; here"), 0u)
        << error;
    EXPECT_NE(error.find(advice), std::string::npos) << error;
  }
}

TEST(Errors, OperatorsStandInBrackets) {
  for (const char* sign :
       {"+", "-", "*", "/", "**", "mod", "AND", "Or", "xor", "EQ", "ne", "GT", "ge", "lt", "LE"})
    for (const char* line :
         {"#2=#1 {} 3", "#2=[#1]{} 3", "G0 X5 {}2", "G0 X#1{}[2]", "#2=sin[30] {}#1", "N5 F7 {} 2"}) {
      const std::string said = Session().error("#1=5\n" + fmt::format(fmt::runtime(line), sign));
      EXPECT_NE(said.find(" stands outside brackets"), said.npos) << line << sign << ": " << said;
    }
  // An operator where no value stands before it, and a line's part that is to be skipped, are something else.
  for (const char* program : {"+5", "*X5", "MOD 5", "G0 X5 / Y3", "G0 X5 /"})
    EXPECT_EQ(Session().error(program).find("outside brackets"), std::string::npos) << program;
  EXPECT_EQ(Session().error("#1=[5 MOD 3 + 2 / 4]\nG0 X-[#1*2]\n/G0 X1\nM2\n"), "");
}

// The pairs are of Unicode's names: LATIN CAPITAL LETTER X beside CYRILLIC CAPITAL LETTER HA, and so on.
TEST(Errors, CharactersThatOnlyLookRightAreNamed) {
  const std::pair<const char*, const char*> kSlips[] = {{"G0 \u04255", "1:4: U+0425 looks like 'X'"},
                                                        {"\u0421 5", "1:1: U+0421 looks like 'C'"},
                                                        {"G0 X1 \u0443-2", "1:7: U+0443 looks like 'y'"},
                                                        {"\u041C3 S100", "1:1: U+041C looks like 'M'"},
                                                        {"G0 \u03965", "1:4: U+0396 looks like 'Z'"},
                                                        {"G0 \u03A55", "1:4: U+03A5 looks like 'Y'"},
                                                        {"G0\u00A0X5", "1:3: U+00A0 looks like a space"},
                                                        {"G0 X5\u200B", "1:6: U+200B looks like a space"},
                                                        {"G0 X \u20135", "1:6: U+2013 looks like '-'"},
                                                        {"G0 X\x96"
                                                         "5",
                                                         "1:5: U+2013 looks like '-'"},
                                                        {"G0\xA0X5", "1:3: U+00A0 looks like a space"},
                                                        {"#1=[2\u00D73]", "1:6: U+00D7 looks like '*'"},
                                                        {"\uFF271 X5", "1:1: U+FF27 looks like 'G'"},
                                                        {"G0 X\uFF15", "1:5: U+FF15 looks like '5'"},
                                                        {"G0 X5 \uFF08end)", "1:7: U+FF08 looks like '('"},
                                                        {"G0 X5 \u3000Y1", "1:7: U+3000 looks like a space"}};
  for (const auto& [line, said] : kSlips) {
    const std::string message = Session().error("G21\n" + std::string(line) + "\nM2\n");
    EXPECT_NE(message.find(":2" + std::string(said).substr(1)), message.npos) << line << ": " << message;
  }
  // In a comment anybody's letters are welcome; what looks like nothing is refused as what it is.
  EXPECT_EQ(Session().error("G0 X5 (\u0425 \u2212 5)\nM2 ; \uFF08\n"), "");
  EXPECT_NE(Session().error("G0 X5\u00B0\n").find("unexpected character 0xC2"), std::string::npos);
}

TEST(Errors, LongLinesAreRefusedInBoundedMemory) {
  const std::string noise(1 << 20, 'X');
  EXPECT_EQ(
      Session().error("G0\n" + noise + "\nG0 X1"),
      "p.ngc:2:1: the line is longer than 65536 bytes; legal: split it, or raise [program] line_length_max");
}

TEST(Errors, AllOfAFileAreTold) {
  Session s;
  test::CanonText sink;
  Interpreter interpreter({s.config, s.parameters, s.tools, nullptr, sink, {}});
  interpreter.open_text("G0 X1\nG0 X\nG999\nG0 X3\nM999\nM2\n", "p.ngc");
  std::vector<std::uint32_t> lines;
  for (bool more = true; more;) {
    try {
      more = interpreter.step();
    } catch (const GcodeError& error) {
      lines.push_back(error.line);
      more = interpreter.recover();
    }
  }
  EXPECT_EQ(lines, (std::vector<std::uint32_t>{2, 3, 5}));
}

// Thirty programs with something broken: each is refused with a place, none crashes or hangs.
// What is refused leaves nothing behind that a later block could trip over.
TEST(Errors, ARefusedToolVectorIsNotInForce) {
  Session session;
  struct Nothing : CanonSink {
    void put(const CanonCommand&, std::uint32_t) override {}
  } nothing;
  Interpreter interpreter(
      {session.config, session.parameters, session.tools, nullptr, nothing, [](const Diagnostic&) {}});
  interpreter.open_text("G43.5 H1\nG0 K1\nM2\n", "p.ngc");
  EXPECT_THROW(interpreter.step(), GcodeError);
  ASSERT_TRUE(interpreter.recover());
  EXPECT_THROW(interpreter.step(), GcodeError) << "K without G43.5";
}

TEST(Errors, ThirtyDamagedPrograms) {
  const char* const damaged[] = {"G0 X1 Y",
                                 "G1 X1 F",
                                 "G2 X5 I",
                                 "((",
                                 "G0 X[",
                                 "G0 X]",
                                 "G0 X[[1]",
                                 "#=1",
                                 "#[",
                                 "#<a",
                                 "#<>=1",
                                 "o",
                                 "o1",
                                 "o1 call [",
                                 "o1 while",
                                 "o1 if [1",
                                 "G",
                                 "M",
                                 "GG0",
                                 "G0 XX1",
                                 "X-",
                                 "X-*1",
                                 "X+-.",
                                 "N",
                                 "N-1",
                                 "G0 X1 /",
                                 "=",
                                 "[1]",
                                 "G0 X1,5",
                                 "G0 X0x10",
                                 "T",
                                 "F#",
                                 "S[ABS]",
                                 "G0 X[ATAN[1]]",
                                 "G0 X[1 FOO 2]",
                                 "o<a",
                                 "%%G0",
                                 "@1"};
  int refused = 0;
  for (const char* program : damaged) {
    const std::string message = Session().error(std::string("G0 X0\n") + program);
    if (std::string(program) == "o1") continue;  // a bare program number is legal
    EXPECT_EQ(message.substr(0, 6), "p.ngc:") << program;
    ++refused;
  }
  EXPECT_GE(refused, 30);
}

// G80 leaves no motion: the first of X, Y and Z is shown, and the line's beginning where there is none.
TEST(Errors, AxisWordsWithoutAMotionAreShown) {
  for (const auto& [block, place] : {std::pair("Y1 X2", "p.ngc:2:4:"), std::pair("A1 Z2", "p.ngc:2:4:"),
                                     std::pair(" A1", "p.ngc:2:1:"), std::pair("F2 C1", "p.ngc:2:1:")})
    EXPECT_EQ(Session().error(std::string("G80\n") + block + "\nM2").find(place), 0u)
        << Session().error(std::string("G80\n") + block + "\nM2");
}

}  // namespace
}  // namespace trn
