#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/interp/gcode/run_program.h"

// Canonical functions of short programs: every modal group, by hand from RS274/NGC's definitions.
namespace trn {
namespace {

using test::canon;
using test::moves;
using test::Session;

TEST(Canon, StartState) {
  test::CanonText sink;
  Session().run("M2\n", sink);
  EXPECT_EQ(
      sink.text.substr(0, sink.text.find("ON_RESET()") + 11),
      "USE_LENGTH_UNITS(CANON_UNITS_MM)\nSET_G5X_OFFSET(1, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n"
      "SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\nSET_XY_ROTATION(0.0000)\n"
      "SET_FEED_REFERENCE(CANON_XYZ)\nON_RESET()\n");
}

TEST(Canon, ProgramEndResets) {
  test::CanonText sink;
  Session().run("G18 G91 M8 M49\nM30\n", sink);
  const std::string end = sink.text.substr(sink.text.find("SET_G5X_OFFSET(1", 60));
  EXPECT_EQ(
      end,
      "SET_G5X_OFFSET(1, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\nSET_XY_ROTATION(0.0000)\n"
      "SELECT_PLANE(CANON_PLANE_XY)\nSET_FEED_MODE(0, 0)\nSET_FEED_RATE(0.0000)\nENABLE_FEED_OVERRIDE()\n"
      "STOP_SPINDLE_TURNING(0)\nSET_SPINDLE_MODE(0 0.0000)\nFLOOD_OFF()\nPALLET_SHUTTLE()\nPROGRAM_END()\n");
}

TEST(Canon, StraightMovesAndDistanceModes) {
  EXPECT_EQ(canon("G0 X1 Y2 Z3\nG91 X1\nG90 X1"),
            moves({"T 1 2 3", "COMMENT(\"interpreter: distance mode changed to incremental\")", "T 2 2 3",
                   "COMMENT(\"interpreter: distance mode changed to absolute\")", "T 1 2 3"}));
  EXPECT_EQ(canon("F100 G1 X5\nY-2"), moves({"SET_FEED_RATE(100.0000)", "F 5 0 0", "F 5 -2 0"}));
}

TEST(Canon, CaseAndWhiteSpaceAreFree) {
  EXPECT_EQ(canon("g 0 x +0. 12 34y 7"), moves({"T 0.1234 7 0"}));
  EXPECT_EQ(canon("\tG00X1Y-.5z+2."), moves({"T 1 -0.5 2"}));
}

TEST(Canon, Units) {
  EXPECT_EQ(canon("G0 X25.4\nG20 G0 Y2\nG21 G0 Z1"),
            moves({"T 25.4 0 0", "USE_LENGTH_UNITS(CANON_UNITS_INCHES)", "T 1 2 0",
                   "USE_LENGTH_UNITS(CANON_UNITS_MM)", "T 25.4 50.8 1"}));
}

TEST(Canon, ArcsInEveryPlane) {
  EXPECT_EQ(canon("F1 G2 X2 I1"),
            "SET_FEED_RATE(1.0000)\nARC_FEED(2.0000, 0.0000, 1.0000, 0.0000, -1, 0.0000, 0.0000, 0.0000, "
            "0.0000)\n");
  EXPECT_EQ(canon("F1 G18 G3 X2 Y5 I1 K0 P3"),
            "SET_FEED_RATE(1.0000)\nSELECT_PLANE(CANON_PLANE_XZ)\n"
            "ARC_FEED(0.0000, 2.0000, 0.0000, 1.0000, 3, 5.0000, 0.0000, 0.0000, 0.0000)\n");
  EXPECT_EQ(canon("F1 G19 G2 Y2 J1 A9"),
            "SET_FEED_RATE(1.0000)\nSELECT_PLANE(CANON_PLANE_YZ)\n"
            "ARC_FEED(2.0000, 0.0000, 1.0000, 0.0000, -1, 0.0000, 9.0000, 0.0000, 0.0000)\n");
  EXPECT_EQ(canon("F1 G90.1 G2 X2 I1 J0"),
            "SET_FEED_RATE(1.0000)\nCOMMENT(\"interpreter: IJK distance mode changed to absolute\")\n"
            "ARC_FEED(2.0000, 0.0000, 1.0000, 0.0000, -1, 0.0000, 0.0000, 0.0000, 0.0000)\n");
  // by radius, shorter and longer way: the centres mirror at the chord
  EXPECT_EQ(
      canon("F1 G3 X6 R5"),
      "SET_FEED_RATE(1.0000)\nARC_FEED(6.0000, 0.0000, 3.0000, 4.0000, 1, 0.0000, 0.0000, 0.0000, 0.0000)\n");
  EXPECT_EQ(canon("F1 G3 X6 R-5"),
            "SET_FEED_RATE(1.0000)\nARC_FEED(6.0000, 0.0000, 3.0000, -4.0000, 1, 0.0000, 0.0000, 0.0000, "
            "0.0000)\n");
}

TEST(Canon, WorkOffsets) {
  EXPECT_EQ(canon("G0 X5\nG10 L2 P2 X10 R90\nG55\nG0 X1"),
            "STRAIGHT_TRAVERSE(5.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n"
            "COMMENT(\"interpreter: setting coordinate system origin\")\n"
            "SET_G5X_OFFSET(2, 10.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n"
            "SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\nSET_XY_ROTATION(90.0000)\n"
            // the machine stands at 5, 0: seen from the turned system that is (0, 5)
            "STRAIGHT_TRAVERSE(1.0000, 5.0000, 0.0000, 0.0000, 0.0000, 0.0000)\n");
  EXPECT_EQ(canon("G0 X5 Y5\nG92 X0 Y1\nG0 X1\nG92.2\nG0 Z1\nG92.3\nG0 Z2\nG92.1\nG0 Z3"),
            moves({"T 5 5 0", "SET_G92_OFFSET(5.0000, 4.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "T 1 1 0",
                   "SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "T 6 5 1",
                   "SET_G92_OFFSET(5.0000, 4.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "T 1 1 2",
                   "SET_G92_OFFSET(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "T 6 5 3"}));
  EXPECT_EQ(canon("G0 X3\nG10 L20 P1 X1\nG0 X0"),
            moves({"T 3 0 0", "SET_G5X_OFFSET(1, 2.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)",
                   "SET_XY_ROTATION(0.0000)", "T 0 0 0"}));
  EXPECT_EQ(canon("G52 X5\nG53 G0 X1"),
            moves({"SET_G92_OFFSET(5.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)", "T -4 0 0"}));
}

TEST(Canon, ToolLength) {
  EXPECT_EQ(
      canon("G43 H1\nG0 X1\nG49"),
      moves({"USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 50.0000, 0.0000 0.0000 0.0000, 0.0000 0.0000 0.0000)",
             "T 1 0 -50",
             "USE_TOOL_LENGTH_OFFSET(0.0000 0.0000 0.0000, 0.0000 0.0000 0.0000, 0.0000 0.0000 0.0000)"}));
}

TEST(Canon, FeedModes) {
  EXPECT_EQ(
      canon("G93 G1 X10 F2\nG1 X20 A10 F4"),
      "COMMENT(\"interpreter: feed mode set to inverse time\")\nSET_FEED_MODE(0, 0)\nSET_FEED_RATE(20.0000)\n"
      "STRAIGHT_FEED(10.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000)\nSET_FEED_RATE(40.0000)\n"
      "STRAIGHT_FEED(20.0000, 0.0000, 0.0000, 10.0000, 0.0000, 0.0000)\n");
}

// Half a turn of radius 1 that rises by 4 is hypot(pi, 4) = 5.0862 mm long, and takes half a minute.
TEST(Canon, InverseTimeOfAHelix) {
  const std::string text = canon("G93 F2 G3 X-2 Z4 I-1");
  EXPECT_NE(text.find("SET_FEED_RATE(10.1724)"), std::string::npos) << text;
}

TEST(Canon, PathModes) {
  EXPECT_EQ(canon("G61\nG61.1\nG64\nG64 P.1\nG64 P.1 Q.2"),
            "SET_MOTION_CONTROL_MODE(CANON_EXACT_PATH)\nSET_MOTION_CONTROL_MODE(CANON_EXACT_STOP)\n"
            "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.000000)\nSET_NAIVECAM_TOLERANCE(0.0000)\n"
            "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.100000)\nSET_NAIVECAM_TOLERANCE(0.1000)\n"
            "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.100000)\nSET_NAIVECAM_TOLERANCE(0.2000)\n");
}

TEST(Canon, SpindleCoolantToolsAndStops) {
  EXPECT_EQ(
      canon("S1000 M3\nM8\nM9\nM5\nT2 M6\nM0\nM1\nG4 P0.5\nM19 R90"),
      "SET_SPINDLE_SPEED(0, 1000.0000)\nSTART_SPINDLE_CLOCKWISE(0)\nFLOOD_ON()\nMIST_OFF()\nFLOOD_OFF()\n"
      "STOP_SPINDLE_TURNING(0)\nSELECT_TOOL(2)\nSTART_CHANGE()\nSTOP_SPINDLE_TURNING(0)\nCHANGE_TOOL(2)\n"
      "PROGRAM_STOP()\nOPTIONAL_PROGRAM_STOP()\nDWELL(0.5000)\nORIENT_SPINDLE(0, 90.0000, 0)\n");
  EXPECT_EQ(
      canon("M48\nM50 P0\nM51 P0\nM52\nM53 P0\nM62 P3\nM65 P1\nM67 E2 Q1.5"),
      "ENABLE_FEED_OVERRIDE()\nENABLE_SPEED_OVERRIDE(0)\nDISABLE_FEED_OVERRIDE()\nDISABLE_SPEED_OVERRIDE(0)\n"
      "ENABLE_ADAPTIVE_FEED()\nDISABLE_FEED_HOLD()\nSET_MOTION_OUTPUT_BIT(3)\nCLEAR_AUX_OUTPUT_BIT(1)\n"
      "SET_MOTION_OUTPUT_VALUE(2,1.500000)\n");
}

TEST(Canon, Messages) {
  EXPECT_EQ(
      canon("#1=2.5\n(MSG, hi)\n(debug,a #1 b %.2f#1 c %d#1)\n(PRINT,#<_x>)\n(plain) G4 P1\n; not told"),
      "MESSAGE(\" hi\")\nMESSAGE(\"a 2.500000 b 2.50 c 2\")\n0.000000\nCOMMENT(\"plain\")\nDWELL(1.0000)\n");
}

TEST(Canon, DrillingCycle) {
  const std::string exact = "SET_MOTION_CONTROL_MODE(CANON_EXACT_PATH)";
  const std::string back = "SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.000000)";
  const std::string naive = "SET_NAIVECAM_TOLERANCE(0.0000)";
  EXPECT_EQ(canon("F1 G0 Z9\nG98 G81 X1 Z-5 R2\nG99 X2"),
            moves({"SET_FEED_RATE(1.0000)", "T 0 0 9", "COMMENT(\"interpreter: retract mode set to old_z\")",
                   exact, "T 1 0 9", "T 1 0 2", "F 1 0 -5", "T 1 0 9", back, naive,
                   "COMMENT(\"interpreter: retract mode set to r_plane\")", exact, "T 2 0 9", "T 2 0 2",
                   "F 2 0 -5", "T 2 0 2", back, naive}));
  EXPECT_EQ(canon("F1 G91 G81 X1 Z-3 R1 L2"),
            moves({"SET_FEED_RATE(1.0000)", "COMMENT(\"interpreter: distance mode changed to incremental\")",
                   "T 0 0 1", exact, "T 1 0 1", "F 1 0 -2", "T 1 0 1", "T 2 0 1", "F 2 0 -2", "T 2 0 1", back,
                   naive}));
  EXPECT_EQ(canon("F1 G83 Z-2.5 R1 Q2"),
            moves({"SET_FEED_RATE(1.0000)", "T 0 0 1", exact, "T 0 0 1", "F 0 0 -1", "T 0 0 1",
                   "T 0 0 -0.746", "F 0 0 -2.5", "T 0 0 1", back, naive}));
}

TEST(Canon, HomePositions) {
  EXPECT_EQ(canon("G0 X3 Y4\nG28.1\nG0 X9\nG28 Y7"), moves({"T 3 4 0", "T 9 4 0", "T 9 7 0", "T 9 4 0"}));
}

TEST(Canon, StateIsKeptAndRestored) {
  EXPECT_EQ(canon("o1 sub\nM73\nG91\nG0 X1\no1 endsub\no1 call\nG0 X5"),
            moves({"COMMENT(\"interpreter: distance mode changed to incremental\")", "T 1 0 0",
                   "COMMENT(\"interpreter: distance mode changed to absolute\")", "T 5 0 0"}));
}

// M70 alone keeps the state for an M72; the end of the sub-program does not bring it back.
TEST(Canon, StateThatIsOnlyKeptIsNotRestored) {
  EXPECT_EQ(canon("o1 sub\nM70\nG91\nG0 X1\no1 endsub\no1 call\nG0 X5"),
            moves({"COMMENT(\"interpreter: distance mode changed to incremental\")", "T 1 0 0", "T 6 0 0"}));
}

// Each word of G64 by itself is reason enough.
TEST(Canon, EveryToleranceIsRestored) {
  const auto last_path = [](const std::string& program) {
    const std::string text = canon(program);
    return text.substr(text.rfind("SET_MOTION_CONTROL_MODE"));
  };
  const std::string kept = last_path("G64 P0.1 Q0.05");
  EXPECT_EQ(last_path("G64 P0.1 Q0.05\nM70\nG64 P0.1 Q0.2\nM72"), kept);
  EXPECT_EQ(last_path("G64 P0.1 Q0.05\nM70\nG64 P0.2 Q0.05\nM72"), kept);
  EXPECT_EQ(last_path("G64 P0.1 Q0.05\nM70\nG61\nM72"), kept);
  const std::string turning = last_path("G64 P0.1 R0.5");
  EXPECT_EQ(last_path("G64 P0.1 R0.5\nM70\nG64 P0.1 R0.1\nM72"), turning);
}

TEST(Canon, BlockDelete) {
  Session session;
  EXPECT_EQ(session.canon("/G0 X1\nG0 Y1"), moves({"T 1 0 0", "T 1 1 0"}));
  session.config.block_delete = true;
  EXPECT_EQ(session.canon("/G0 X1\nG0 Y1"), moves({"T 0 1 0"}));
}

TEST(Canon, WrappedRotaryGoesTheShortWay) {
  Session session;
  session.config.wrapped_mask = 1U << kC;
  EXPECT_EQ(session.canon("G0 C350\nG0 C10"),
            "STRAIGHT_TRAVERSE(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, -10.0000)\n"
            "STRAIGHT_TRAVERSE(0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 10.0000)\n");
}

// As LinuxCNC's wrapped rotary axes: the angle without its sign, the sign is the way round. By hand from its
// documents (INI, AXIS section, WRAPPED_ROTARY).
TEST(Canon, WrappedRotaryGoesByItsSign) {
  Session session;
  session.config.wrapped_mask = 1U << kC;
  session.config.wrapped_by_sign = true;
  const auto ends = [&](const std::string& program) {
    std::vector<double> out;
    std::istringstream lines(session.canon(program));
    for (std::string line; std::getline(lines, line);)
      if (line.find("STRAIGHT_") != std::string::npos)
        out.push_back(std::stod(line.substr(line.rfind(',') + 1)));
    return out;
  };
  EXPECT_EQ(ends("G0 C350\nG0 C10\nG0 C350\nG0 C10"), (std::vector<double>{350, 370, 710, 730}));
  EXPECT_EQ(ends("G0 C-350\nG0 C-10\nG0 C20\nG0 C-0"), (std::vector<double>{-10, -350, -340, -360}));
  EXPECT_EQ(ends("G0 C90\nG0 C90\nG0 C-90"), (std::vector<double>{90, 90, 90})) << "there already: no turn";
  EXPECT_EQ(ends("F100 G1 C-90").back(), -270) << "feed moves alike";
  EXPECT_EQ(ends("G0 C90\nG91 G0 C-30").back(), 60) << "relative words are ways";
  EXPECT_EQ(ends("G0 C30\nG53 G0 C10").back(), 370) << "machine coordinates, too";
  EXPECT_EQ(ends("G0 C30\nG53 G0 C-10").back(), 10);
  for (const std::string word : {"360", "-400", "1000"})
    EXPECT_EQ(session.error("G0 X1 C" + word).substr(0, 63 + word.size()),
              "p.ngc:1:7: C = " + word + " is not legal for a wrapped axis: an angle below");
}

// A machine whose programs are in inches: G20 is in force when they begin, and the machine's place is the
// same.
TEST(Canon, ProgramsMayBeginInInches) {
  Session session;
  session.config.inch = true;
  EXPECT_EQ(session.canon("G0 X1\nG21 G0 X2"), "USE_LENGTH_UNITS(CANON_UNITS_INCHES)\n" + moves({"T 1 0 0"}) +
                                                   "USE_LENGTH_UNITS(CANON_UNITS_MM)\n" + moves({"T 2 0 0"}));
}

TEST(Canon, CutterCompensation) {
  // outside corner: rounded about the corner; inside corner: where the offsets meet
  EXPECT_EQ(
      canon("F1 G42.1 D10\nG1 X0 Y-10\nG1 X50\nY50\nG40 X99"),
      moves({"SET_FEED_RATE(1.0000)", "COMMENT(\"interpreter: cutter radius compensation on right\")",
             "F -5 -10 0", "ARC_FEED(0.0000, -15.0000, 0.0000, -10.0000, 1, 0.0000, 0.0000, 0.0000, 0.0000)",
             "F 50 -15 0",
             "ARC_FEED(55.0000, -10.0000, 50.0000, -10.0000, 1, 0.0000, 0.0000, 0.0000, 0.0000)", "F 55 50 0",
             "COMMENT(\"interpreter: cutter radius compensation off\")", "F 99 50 0"}));
  EXPECT_EQ(canon("F1 G41.1 D10\nG1 X10\nX50\nY50\nX0\nG40 X-20"),
            moves({"SET_FEED_RATE(1.0000)", "COMMENT(\"interpreter: cutter radius compensation on left\")",
                   "F 10 5 0", "F 45 5 0", "F 45 45 0", "F 0 45 0",
                   "COMMENT(\"interpreter: cutter radius compensation off\")", "F -20 50 0"}));
}

// L0 is the centre of a nose, which is what a mill has.
TEST(Canon, CutterCompensationTakesAnOrientation) {
  const std::string contour = "\nG1 X10\nX30\nG40 X40";
  EXPECT_EQ(canon("F1 G18 G41.1 D2 L0" + contour), canon("F1 G18 G41.1 D2" + contour));
  for (const char* word : {"L-1", "L10", "L1.5"})
    EXPECT_NE(Session().error(std::string("F1 G18 G41.1 D2 ") + word).find("an orientation from 0 to 9"),
              std::string::npos)
        << word;
}

// Numbers as Debian's rs274 prints them for the same programs.
TEST(Canon, CutterCompensationEntersByAnArc) {
  const std::string start =
      "SET_FEED_RATE(1.0000)\nCOMMENT(\"interpreter: cutter radius compensation on left\")\n";
  EXPECT_EQ(canon("F1 G41.1 D2\nG3 X10 Y10 J10\nG1 Y30\nG40"),
            start + "ARC_FEED(9.0000, 10.0000, -1.0556, 10.0000, 1, 0.0000, 0.0000, 0.0000, 0.0000)\n" +
                moves({"F 9 30 0", "COMMENT(\"interpreter: cutter radius compensation off\")"}));
  EXPECT_EQ(canon("F1 G41.1 D2\nG2 X10 Y-10 J-10\nG1 Y-30\nG40"),
            start + "ARC_FEED(11.0000, -10.0000, 0.9545, -10.0000, -1, 0.0000, 0.0000, 0.0000, 0.0000)\n" +
                moves({"F 11 -30 0", "COMMENT(\"interpreter: cutter radius compensation off\")"}));
  EXPECT_NE(Session().error("F1 G41.1 D2\nG3 X.5 Y.5 J.5").find("the entry arc"), std::string::npos);
}

TEST(Canon, ARapidAfterAnOutsideCornerGoesStraight) {
  EXPECT_EQ(canon("F1 G42.1 D2\nG1 X10\nX30\nG0 Y20\nG40"),
            moves({"SET_FEED_RATE(1.0000)", "COMMENT(\"interpreter: cutter radius compensation on right\")",
                   "F 10 -1 0", "F 30 -1 0", "T 31 0 0", "T 31 20 0",
                   "COMMENT(\"interpreter: cutter radius compensation off\")"}));
}

TEST(Canon, FlatCornersAreNoCorners) {
  EXPECT_EQ(canon("F1 G42.1 D2\nG1 X10\nX30\nX50 Y0.9\nG40"),
            moves({"SET_FEED_RATE(1.0000)", "COMMENT(\"interpreter: cutter radius compensation on right\")",
                   "F 10 -1 0", "F 30 -1 0", "F 50.0450 -0.0990 0",
                   "COMMENT(\"interpreter: cutter radius compensation off\")"}));
}

TEST(Canon, WhatCompensationForbids) {
  for (const char* line :
       {"M48", "M50 P0", "G61", "G64 P1", "G10 L2 P1 X0", "G54", "G43 H1", "G52 X1", "G28.1", "G98", "M62 P1",
        "M66 P1 L0", "M67 E1 Q1", "#1=#5420", "G49", "G20", "M6", "G5 X1 I1 P1 Q1"})
    EXPECT_NE(Session().error(std::string("F1 G41.1 D2\nG1 X10\nX20\n") + line).find("compensation is on"),
              std::string::npos)
        << line;
}

TEST(Canon, ToolEntriesTurnWithTheirSystem) {
  Session session;
  const std::string text = session.canon("T1 M6\nG10 L2 P0 R30\nG0 X10 Y20\nG10 L10 P2 Y5\nG10 L1 P1 Z4");
  // here (0, 15) turned by 30 degrees
  EXPECT_NE(text.find("SET_TOOL_TABLE_ENTRY(2, 2, -7.5000 12.9904 80.5000 "), std::string::npos) << text;
  // the tool in the spindle has its entry twice
  EXPECT_NE(text.find("SET_TOOL_TABLE_ENTRY(0, 1, 0.0000 0.0000 4.0000 "), std::string::npos) << text;
}

// What a cycle switches off for itself comes back as the program had it.
TEST(Canon, AThreadLeavesTheFeedOverrideAsItWas) {
  const std::string pass = "G76 P1 Z-5 I-1 J0.5 K1 R1 Q0 H0 E0 L0\n";
  for (const bool on : {true, false}) {
    test::CanonText sink;
    Session().run(std::string("G18 F10 S100 M3\nG0 X10 Z0\n") + (on ? "" : "M50 P0\n") + pass + "M2\n", sink);
    const std::string cycle = sink.text.substr(0, sink.text.rfind("SET_G5X_OFFSET(1"));
    EXPECT_NE(cycle.find("START_SPEED_FEED_SYNC("), std::string::npos) << "no thread was cut";
    EXPECT_EQ(cycle.find("ENABLE_FEED_OVERRIDE()") != std::string::npos &&
                  cycle.rfind("ENABLE_FEED_OVERRIDE()") > cycle.rfind("DISABLE_FEED_OVERRIDE()"),
              on);
  }
}

}  // namespace
}  // namespace trn
