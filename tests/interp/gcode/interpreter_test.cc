#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "core/config.h"
#include "interp/move.h"
#include "tests/interp/gcode/run_program.h"

// What programs and tables of other controls bring along: accepted, passed over, or refused by its name.
namespace trn {
namespace {

using test::canon;
using test::Session;

/// Straight moves and messages alone, for short comparisons.
std::string told(Session session, const std::string& program) {
  test::CanonText sink;
  session.run(program, sink);
  std::string out;
  std::istringstream in(sink.text);
  for (std::string line; std::getline(in, line);)
    if (line.rfind("STRAIGHT", 0) == 0 || line.rfind("MESSAGE", 0) == 0) out += line + "\n";
  return out;
}

Session ignoring(const std::string& words) {
  Session session;
  session.config = read_program_config(parse_config("[program]\nignored = [" + words + "]\n", "m.toml"));
  return session;
}

bool any_has(const std::vector<std::string>& lines, const std::string& part) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

// #<_abs_x> is the place that G53 takes the machine to, in the units of the program, whatever acts between.
TEST(Dialect, AbsoluteParametersAreTheWordsOfG53) {
  std::mt19937 rng(20);
  const auto pick = [&] { return static_cast<double>(static_cast<int>(rng() % 2000) - 1000) / 100; };
  for (int i = 0; i < 300; ++i) {
    std::string program = rng() % 2 ? "G20\n" : "G21\n";
    program +=
        fmt::format("G10 L2 P2 X{} Y{} Z{} A{} R{}\nG0 X{} Y{} Z{} A{} B{} C{}\n", pick(), pick(), pick(),
                    pick(), rng() % 2 ? pick() * 9 : 0.0, pick(), pick(), pick(), pick(), pick(), pick());
    for (int k = 0; k < 4; ++k) {
      const std::string steps[] = {"G55",          "G54", fmt::format("G92 X{} Z{}", pick(), pick()),
                                   "T3 M6 G43",    "G20", "G21",
                                   "T2 M6 G43 H3", "G49", fmt::format("G52 Y{}", pick())};
      program += steps[rng() % std::size(steps)] + "\n";
    }
    Session session;
    test::CanonText sink;
    Interpreter interpreter({session.config, session.parameters, session.tools, nullptr, sink, {}});
    interpreter.open_text(
        program +
            "#1=#<_x> #2=#<_y> #3=#<_z> #4=#<_a> #5=#5420\n"
            "G53 G0 X#<_abs_x> Y#<_abs_y> Z#<_abs_z> A#<_abs_a> B#<_abs_b> C#<_abs_c>\nM0\nM2\n",
        "p.ngc");
    while (sink.text.find("PROGRAM_STOP") == std::string::npos) {
      ASSERT_TRUE(interpreter.step()) << program;
    }
    for (int axis = 0; axis < 4; ++axis)
      EXPECT_NEAR(session.parameters[1 + axis], interpreter.settings().position[axis], 1e-9) << program;
    EXPECT_EQ(session.parameters[1], session.parameters[5]);
  }
}

TEST(Dialect, NamedLengthsAreInProgramUnits) {
  const std::string program =
      "T2 M6 G43\nG0 X25.4 Y50.8\nG20\n(DEBUG,#<_abs_x> #<_y> #<_tool_length> #<_tool_diameter>)\n"
      "G21\n(DEBUG,#<_abs_x> #<_y> #<_tool_length> #<_tool_diameter> #5403 #5410)\nM2\n";
  EXPECT_NE(told({}, program).find("MESSAGE(\"1.000000 2.000000 3.169291 0.393701\")"), std::string::npos);
  EXPECT_NE(
      told({}, program).find("MESSAGE(\"25.400000 50.800000 80.500000 10.000000 80.500000 10.000000\")"),
      std::string::npos);
}

TEST(Dialect, ToolParametersFollowTheTable) {
  EXPECT_EQ(
      told({}, "T1 M6\nG10 L1 P1 Z7 R2 I11 J12 Q3\n(DEBUG,%d #5400 #5403 #5410 #5411 #5412 #5413)\nM2\n"),
      "MESSAGE(\" 1 7 4 11 12 3\")\n");
  EXPECT_EQ(told({}, "T1 M6\nG0 Z9\nG10 L10 P1 X2 Z3\n(DEBUG,%d #5401 #5403)\nM2\n"),
            "STRAIGHT_TRAVERSE(0.0000, 0.0000, 9.0000, 0.0000, 0.0000, 0.0000)\nMESSAGE(\" -2 6\")\n");
  EXPECT_EQ(told({}, "T1 M6\nG0 Z9\nG10 L11 P1 Z4\n(DEBUG,%d #5403)\nM2\n").substr(66), "MESSAGE(\" 5\")\n");
  EXPECT_EQ(told({}, "T1 M6\nG10 L1 P2 Z7\n(DEBUG,%d #5403)\nM2\n"), "MESSAGE(\" 50\")\n")
      << "the entry of another tool";
}

TEST(Dialect, MotionWordBesideG28OnlySetsTheMode) {
  const std::string home =
      "STRAIGHT_TRAVERSE(5.0000, 0.0000, 3.0000, 0.0000, 0.0000, 0.0000)\n"
      "STRAIGHT_TRAVERSE(5.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n";
  const std::string start = "STRAIGHT_TRAVERSE(5.0000, 0.0000, 3.0000, 0.0000, 0.0000, 0.0000)\n";
  const std::string back = "(5.0000, 0.0000, 1.0000, 0.0000, 0.0000, 0.0000)\n";
  EXPECT_EQ(told({}, "F1 G0 X5 Z3\nG1 G91 G28 Z0.\nZ1\nM2\n"), start + home + "STRAIGHT_FEED" + back);
  EXPECT_EQ(told({}, "F1 G1 X5 Z3\nG0 G91 G28 Z0.\nZ1\nM2\n"),
            "STRAIGHT_FEED" + start.substr(17) + home + "STRAIGHT_TRAVERSE" + back);
  EXPECT_EQ(told({}, "F1 G0 X5 Z3\nG0 G91 G30 Z0.\nZ1\nM2\n"), start + home + "STRAIGHT_TRAVERSE" + back);
  for (const char* other : {"G0 G92 X1", "G1 G10 L2 P1 X1", "G81 G28 Z0", "G0 G52 X1"})
    EXPECT_NE(Session().error(other), "") << other;
}

TEST(Dialect, ZeroAcrossThePlaneOfAnArcMeansNothing) {
  EXPECT_EQ(canon("F1 G2 X2 I1 K0"), canon("F1 G2 X2 I1"));
  EXPECT_EQ(canon("F1 G18 G2 X2 I1 J0"), canon("F1 G18 G2 X2 I1"));
  EXPECT_EQ(canon("F1 G19 G2 Y2 J1 I-0.0"), canon("F1 G19 G2 Y2 J1"));
  EXPECT_EQ(canon("F1 G90.1 G2 X2 I1 J0 K[1-1]"), canon("F1 G90.1 G2 X2 I1 J0"));
  EXPECT_NE(Session().error("F1 G2 X2 I1 K0.1"), "");
  EXPECT_NE(Session().error("F1 G2 X2 K0"), "") << "no centre";
}

TEST(Dialect, CommentsMayStandBetweenTheArgumentsOfACall) {
  EXPECT_EQ(canon("o1 sub\nG0 X#1 Y#2 Z#3\no1 endsub\no1 call (one) [1] (two) [2](three)[3] (end)"),
            test::moves({"T 1 2 3"}));
  EXPECT_EQ(canon("o1 if (is it) [1]\nG0 X1\no1 endif"), test::moves({"T 1 0 0"}));
}

TEST(Dialect, StrayCarriageReturnsAndAByteOrderMark) {
  EXPECT_EQ(canon("\xEF\xBB\xBFG0 X1\r\r\nY2\r\r\r\n"), test::moves({"T 1 0 0", "T 1 2 0"}));
  EXPECT_EQ(ToolTable::parse("T1 P1 Z5\r\r\nT2 P2 Z6\r\r\n", "t.tbl").find(2)->offset[kZ], 6);
}

TEST(Dialect, TheEndOfAFile) {
  const auto run = [](ProgramEnd end, const std::string& program) {
    Session session;
    session.config.end = end;
    test::CanonText sink;
    session.run(program, sink);
    EXPECT_NE(sink.text.find("STRAIGHT_TRAVERSE(1.0000"), std::string::npos);
    return session.warnings.size();
  };
  EXPECT_EQ(run(ProgramEnd::kExpected, "G0 X1\n"), 1U);
  EXPECT_EQ(run(ProgramEnd::kExpected, "%\nG0 X1\n"), 1U);
  EXPECT_EQ(run(ProgramEnd::kFree, "G0 X1\n"), 0U);
  EXPECT_EQ(run(ProgramEnd::kExpected, "G0 X1\nM30\n"), 0U);
  EXPECT_EQ(run(ProgramEnd::kExpected, "%\nG0 X1\n%\n"), 0U);
  EXPECT_THROW(run(ProgramEnd::kRequired, "G0 X1\n"), GcodeError);
  EXPECT_EQ(read_program_config(parse_config("[program]\nend_required = true\n", "m.toml")).end,
            ProgramEnd::kRequired);
  EXPECT_EQ(read_program_config(parse_config("[program]\nend_required = false\n", "m.toml")).end,
            ProgramEnd::kFree);
  EXPECT_EQ(read_program_config(parse_config("[program]\n", "m.toml")).end, ProgramEnd::kExpected);
}

TEST(Dialect, IgnoredGWordsTakeTheirWordsAlong) {
  Session session = ignoring("\"G187\", \"G8 P1\", \"G5 P10000\", \"G5 P0\", \"M31\", \"G234\"");
  EXPECT_EQ(
      told(session, "F9 G1 X1\nG187 P2 E0.05\nG8 P1\nG5 P10000\nX2 M31\nG234\nG0 G187 P1 X3\nG5 P0\nM2\n"),
      told({}, "F9 G1 X1\nX2\nG0 X3\nM2\n"));
  test::CanonText sink;
  session.warnings.clear();
  session.run("G187 P2 E0.05\nG187 P1\nG5 P10000\nM2\n", sink);
  EXPECT_EQ(session.warnings.size(), 2U) << "one a word";
  EXPECT_EQ(session.warnings[0],
            "p.ngc:1:1: warning: g187 is ignored, as the config says, with its words E P");
}

// A code that is passed over must not leave its axis words to the mode that happens to be active.
TEST(Dialect, IgnoredGWordsNeverMove) {
  Session session = ignoring("\"G68\", \"G31\"");
  EXPECT_EQ(told(session, "F9 G1 X1\nG68 X50 Y50 R30\nG31 Z-9 F20\nX2\nM2\n"),
            told({}, "F9 G1 X1\nX2\nM2\n"));
  test::CanonText sink;
  session.warnings.clear();
  session.run("F9 G1 X1\nG31 Z-9\nG31 Z-8\nM2\n", sink);
  EXPECT_EQ(session.warnings.size(), 2U) << "every time that a place is passed over";
}

TEST(Dialect, CodesWithAMeaningAreIgnoredOnlyAsTheyAreWritten) {
  const Session session = ignoring("\"G8 P1\", \"G5 P10000\", \"G187 P1\"");
  for (const char* line : {"G8 P2", "G8 P1 X1", "G187 P2", "G187"})
    EXPECT_NE(Session(session).error(line), "") << line;
  EXPECT_EQ(Session(session).error("F9 G5 X1 Y1 I1 J1 P10000 Q1\nG8"), "") << "a spline";
  EXPECT_EQ(Session(session).canon("G4 P1"), canon("G4 P1")) << "another code with such a word";
  const auto refused = [](const std::string& words) {
    try {
      ignoring(words);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused("\"G5\"").find("meaning of its own"), std::string::npos);
  EXPECT_NE(refused("\"G187 X\"").find("is no word with a number"), std::string::npos);
  EXPECT_NE(refused("\"G18.75\"").find("is no word"), std::string::npos);
  EXPECT_NE(refused("\"G1000\"").find("out of range"), std::string::npos);
  EXPECT_NE(refused("\"G187\", \"g187\"").find("mapped twice"), std::string::npos);
}

TEST(Dialect, MainProgramsWithM99BeginAgain) {
  Session session;
  EXPECT_EQ(told(session,
                 "%\nO0001\n#100=[#100+1]\nG0 X#100\no1 if [#100 ge 3]\nM30\no1 endif\nM99\nO100\nG0 "
                 "Z-77\nM99\n%\n"),
            told({}, "G0 X1\nX2\nX3\nM2\n"));
  test::CanonText sink;
  session.run("O1\no1 repeat [9]\no2 if [1]\nG0 X1\nM99\no2 endif\no1 endrepeat\nO100\nG0 Z-77\nM99\n", sink,
              50);
  EXPECT_EQ(sink.text.find("-77"), std::string::npos);
  EXPECT_EQ(std::count_if(session.warnings.begin(), session.warnings.end(),
                          [](const std::string& w) { return w.find("begins again") != std::string::npos; }),
            1);
}

TEST(Dialect, AProgramThatGoesRoundForEverEndsWhereNobodyWaits) {
  Session session;
  test::CanonText sink;
  Interpreter interpreter({session.config, session.parameters, session.tools, nullptr, sink,
                           [&](const Diagnostic& w) { session.warnings.push_back(w.text); }, false, true});
  interpreter.open_text("%\nO1\nG21 G90\nG0 X1\nG91 X1\nG90 M98 P100\nM99\nO100\nG0 Z-7\nM99\n%\n", "p.ngc");
  int steps = 0;
  while (interpreter.step()) ASSERT_LT(++steps, 100);
  EXPECT_TRUE(interpreter.came_round());
  EXPECT_TRUE(any_has(session.warnings, "p.ngc:7:1: warning: a pass begins here just as an earlier one"));
  const auto passes = [&](const std::string& text) {
    session.parameters = {};
    interpreter.open_text(text, "p.ngc");
    steps = 0;
    while (steps < 1000 && interpreter.step()) ++steps;
    return steps;
  };
  EXPECT_EQ(passes("G91 G0 X1\nG90\nM99\n"), 1000) << "it stands elsewhere at every pass";
  EXPECT_EQ(passes("#100=[#100+1]\nM99\n"), 1000) << "it counts";
  EXPECT_LT(passes("#100=[[#100+1] MOD 5]\nM99\n"), 100) << "a round of five passes";
  EXPECT_EQ(passes("G90 #<_n>=[EXISTS[#<_n>]+1]\nG0 X1\nM99\n"), 8);
}

TEST(Dialect, ProgramsDoNotRunOnIntoTheNext) {
  for (const char* program :
       {"O1\nG0 X1\nO100\nG0 Z-77\nM99", "O1\nM98 P100\nM30\nO100\nG0 Z1\nO200\nG0 Z2\nM99",
        "G0 X1\nO1\nG0 X2\nO2\nG0 Z-77"})
    EXPECT_NE(Session().error(program).find("another program begins here"), std::string::npos) << program;
  EXPECT_EQ(Session().error("O1\nM98 P2\nM30\nO2\nG0 X1\nM99\nO3\nM99"), "");
  EXPECT_EQ(Session().error("(head)\nG21\nO1 (number)\nG0 X1"), "");
}

TEST(Dialect, WordsOfOtherControlsAreNamed) {
  const auto names = [](const char* line, const char* part) {
    const std::string message = Session().error(std::string("#1=1\n") + line);
    EXPECT_NE(message.find(part), std::string::npos) << line << ": " << message;
    EXPECT_EQ(message.rfind("p.ngc:2:", 0), 0U) << message;
  };
  for (const char* line : {"IF [#1 EQ 1] GOTO 10", "IF[#1EQ1]GOTO10", "N20 if [#1 gt 2] then #1=3",
                           "IF R1>5 GOTOF X", "  IF #1 GT 2 THEN", "ELSE", "ENDIF"})
    names(line, "o100 if [#1 eq 2]");
  for (const char* line : {"WHILE [#1 LT 5] DO1", "WHILE[#1LT5]DO 1", "END1", "FOR R1=1 TO 5", "LOOP", "DO1"})
    names(line, "o100 while [#1 lt 5]");
  for (const char* line : {"GOTO 10", "GOTOB LABEL", "G0 X1 GOTO5"}) names(line, "there are no jumps");
  for (const char* line : {"X=10", "G1 X=10 F9", "R1=5", "G0 X1 Y=2"})
    names(line, "X10 for X=10, #1=5 for R1=5");
  for (const char* line : {"$H", "$X", "$$", "$J=G91 X10 F100", "$130=500", "$ 32 = 1", "M3 S500 $"})
    names(line, "'trunnion home'");
  EXPECT_EQ(Session().error("M3 S500 $0\nS600 $-1"), "");
  names("M3 S500 $1", "$ = 1 is not legal for a spindle");
  for (const char* line :
       {"MSG", "STOPRE", "G0 SUPA X1", "BEGIN PGM 1 MM", "CYCL DEF 200", "TRANS X5", "NEXT"})
    names(line, "is no word of this language");
  names("IF [#1 EQ 1] GOTO 10", "p.ngc:2:1:");
  names("G0 X1 GOTO5", "p.ngc:2:7:");
  for (const char* line : {"o1 if", "o1 while", "o1 foo [1]"}) names(line, "bad O-word");
  names("G0 X FOO[1]", "unknown operator or function");
  names("G0 X[1 FOO 2]", "unknown operator or function");
}

TEST(Dialect, ParametersOfOtherControlsAreWarnedAbout) {
  Session session;
  session.canon("#3000=1\n#1=#5041\n#3000=2\n#2=[#5021+#5042]\nG4 P500\nG4 P501\n#3001=0 #4000=1\n#1=#4000");
  EXPECT_EQ(session.warnings.size(), 3U);
  EXPECT_TRUE(any_has(session.warnings, "p.ngc:1:1: warning: #3000 and #3006"));
  EXPECT_TRUE(any_has(session.warnings, "p.ngc:2:4: warning: this parameter is always 0 here"));
  EXPECT_TRUE(any_has(session.warnings, "p.ngc:5:4: warning: G4 P500 waits 500 seconds"));
  EXPECT_NE(Session().error("G0 X#<_ini[axis_x]max_limit>").find("INI file"), std::string::npos);
  EXPECT_NE(Session().error("G0 X#<_hal[motion.x]>").find("HAL"), std::string::npos);
  EXPECT_EQ(Session().error("o1 if [EXISTS[#<_ini[a]b>]]\nG0 X#<_ini[a]b>\no1 endif"), "");
}

TEST(Dialect, TablesOfOld) {
  const ToolTable table =
      ToolTable::parse("POC FMS LEN DIAM COMMENT\n\nT0 P0 Z0 D0\nT1 P1 Z5 ;one\n; T3\nT2 P7 Z6\n", "old.tbl");
  EXPECT_EQ(table.tools().size(), 2U);
  EXPECT_EQ(table.find(0), nullptr);
  EXPECT_EQ(table.find(1)->slot, 2) << "a line of the table each";
  EXPECT_EQ(table.find(2)->slot, 3);
  EXPECT_THROW(ToolTable::parse("T1 P1\nPOC FMS LEN\n", "t.tbl"), ProgramError) << "no headline";
  EXPECT_THROW(ToolTable::parse("1 1 0.5 0.1\n", "t.tbl"), ProgramError);
}

TEST(Dialect, ToolsThatAreNotThere) {
  Session none;
  none.tools = ToolTable();
  EXPECT_NE(none.error("G43 H7").find("tool 7 is not known: no tool table was given"), std::string::npos);
  EXPECT_NE(none.error("G43 H7").find("--tools FILE.tbl"), std::string::npos);
  EXPECT_NE(Session().error("T7 M6").find("tool 7 is not in t.tbl"), std::string::npos);
  Session without_one;
  without_one.tools = ToolTable::parse("T2 P2 Z6\n", "t.tbl");
  EXPECT_NE(without_one.error("T1 M6").find("tool 1 is not in t.tbl"), std::string::npos);
  EXPECT_EQ(without_one.error("T0 M6"), "") << "no tool in the spindle";
}

// A thousandth of the greater radius, as the family takes it.
TEST(Dialect, ArcsWhoseRadiiDifferByAThousandth) {
  EXPECT_EQ(Session().error("F1 G0 X100\nG3 X0 Y100.1 I-100 J0"), "");
  EXPECT_EQ(Session().error("F1 G0 X100\nG3 X0 Y99.9 I-100 J0"), "");
  EXPECT_NE(Session().error("F1 G0 X100\nG3 X0 Y100.102 I-100 J0"), "");
}

TEST(Dialect, DigitsOfMessages) {
  EXPECT_EQ(canon("#1=1.23456789\n(DEBUG,#1 %f #1 %.3f #1 %d #1)"),
            "MESSAGE(\"1.234568  1.2346  1.235  1\")\n");
}

// The first axis word of the line, wherever it stands, or the letter that was asked for.
// The operator has changed the tool since the program was given up: its own M61 does not count up to there.
TEST(Interpreter, AToolThatTheOperatorPutInStays) {
  const auto tool_after = [](std::uint64_t until_block) {
    Session session;
    session.config.measured.numbers[parameter::kTool] = {2, until_block};
    test::CanonText sink;
    session.run("M61 Q1\nG4 P1\nM2\n", sink);
    return std::as_const(session.parameters)[parameter::kTool];
  };
  EXPECT_EQ(tool_after(2), 2);
  EXPECT_EQ(tool_after(0), 1) << "the program's line comes later";
}

TEST(Interpreter, APlaceIsThatOfTheFirstAxisWord) {
  for (const auto& [block, first, of_x] : {std::tuple("G1 F9 Y1 X2", "p.ngc:1:7", "p.ngc:1:10"),
                                           std::tuple("X2 Y1 G1 F9", "p.ngc:1:1", "p.ngc:1:1"),
                                           std::tuple("G1 X2 F9 Y1", "p.ngc:1:4", "p.ngc:1:4"),
                                           std::tuple("F9 Z1 G1 A3 X4", "p.ngc:1:4", "p.ngc:1:13")}) {
    Session s;
    test::CanonText sink;
    Interpreter interpreter({s.config, s.parameters, s.tools, nullptr, sink, {}});
    interpreter.open_text(std::string(block) + "\nM2\n", "p.ngc");
    ASSERT_TRUE(interpreter.step());
    EXPECT_EQ(interpreter.place_of(1, 0), first) << block;
    EXPECT_EQ(interpreter.place_of(1, 'X'), of_x) << block;
    EXPECT_EQ(interpreter.place_of(7, 0), "p.ngc:7:1") << "of another line nothing is known";
  }
}

}  // namespace
}  // namespace trn
