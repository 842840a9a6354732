#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/path.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor/nurbs.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/interp/gcode/run_program.h"
#include "tests/support/paths.h"

// The planner's moves: offsets, tool-centre-point control, feeds; and the table files.
namespace trn {
namespace {

using test::cradle;
using test::MoveList;
using test::Session;

// Where the move ends, as pose of the spindle nose in the table frame, worked out by the bracket's own rule.
Pose nose(const Kinematics& kinematics, const ProgramMove& move, const Words& words) {
  const Vec3& tool = move.context.tool_offset;
  if (move.context.rtcp) {
    const Mat3 R = kinematics.orientation(words.tail<3>());
    return {R, Vec3(words.head<3>()) + R * tool};
  }
  Words axes = words;
  axes.head<3>() += tool;
  JointVec q;
  Pose X;
  EXPECT_EQ(kinematics.joints_from_words(axes, q), KinStatus::kOk);
  EXPECT_EQ(kinematics.forward(q, X), KinStatus::kOk);
  return X;
}

// The machine never jumps: every move begins where the last one ended.
void expect_continuous(const Session& session, const MoveList& list) {
  for (std::size_t i = 1; i < list.moves.size(); ++i) {
    const Pose a = nose(*session.kinematics, list.moves[i - 1], list.moves[i - 1].to);
    const Pose b = nose(*session.kinematics, list.moves[i], list.moves[i].from);
    EXPECT_LT((a.p - b.p).norm(), 1e-9) << "move " << i << " line " << list.moves[i].source.line;
    EXPECT_LT((a.R - b.R).norm(), 1e-9) << i;
  }
}

// What W says of the end of a move is what the program says.
Vec3 in_work(const ProgramMove& move, const Kinematics& kinematics) {
  const Pose X_BS = nose(kinematics, move, move.to);
  return move.context.X_WB * (X_BS * Vec3(-move.context.tool_offset));
}

TEST(Lowering, OffsetsWithoutRtcp) {
  Session session;
  const MoveList list = session.moves("G10 L2 P1 X10 Y20 R90\nG43 H1\nG0 X1 Y0 Z5\nM2\n");
  ASSERT_EQ(list.moves.size(), 1u);
  EXPECT_NEAR(list.moves[0].to[kX], 10, 1e-12);
  EXPECT_NEAR(list.moves[0].to[kY], 21, 1e-12);
  EXPECT_NEAR(list.moves[0].to[kZ], 5, 1e-12);
  EXPECT_EQ(list.moves[0].from[kZ], -50);  // the spindle stood at 0, the tip 50 below
  EXPECT_EQ(list.moves[0].context.tool_offset, Vec3(0, 0, 50));
}

TEST(Lowering, RtcpKeepsTheMachineAndHoldsTheTip) {
  Session session = cradle();
  const MoveList list = session.moves(
      "G54 G10 L2 P1 X10 Y5 Z-20\nG0 X20 Y30 Z100 A20 C50\nG43.4 H1\nG1 F1000 A35 C80\nX0 Y0 Z0\nG49\nG0 "
      "Z150\n"
      "G43 H2\nM428\nG1 A0 C0\nM429\nG0 X0\nM2\n");
  expect_continuous(session, list);
  int with_rtcp = 0;
  for (const ProgramMove& move : list.moves) with_rtcp += move.context.rtcp;
  EXPECT_EQ(with_rtcp, 3);
  for (const ProgramMove& move : list.moves) {
    if (!move.context.rtcp || (move.to - move.from).tail<3>().norm() == 0) continue;
    EXPECT_LT((move.to - move.from).head<3>().norm(), 1e-9) << "only A and C turn: the tip stays";
  }
  EXPECT_LT(in_work(list.moves[2], *session.kinematics).norm(), 1e-9);  // X0 Y0 Z0 of G54
}

TEST(Lowering, WordsOfOtherControls) {
  for (const char* word : {"M428", "TRAORI", "M128"}) {
    Session session = cradle();
    const MoveList list = session.moves(std::string(word) + "\nG0 X1 A10\nG53 G0 Z100\nG0 X2\nM2\n");
    EXPECT_TRUE(list.moves.front().context.rtcp) << word;
    EXPECT_FALSE(list.moves[1].context.rtcp) << "G53 is in axis coordinates";
    EXPECT_TRUE(list.moves[2].context.rtcp);
    expect_continuous(session, list);
  }
}

// The tool axis of the moves' chords stays on the plane through its programmed ends, and advances evenly.
TEST(Lowering, ToolAxisOnAGreatCircle) {
  Session session = cradle();
  const MoveList list = session.moves(
      "G0 X20 Y30 Z100 A20 C0\nTRAORI\nORIVECT\nG1 F1000 X40 A50 C70\nORIAXES\nX20 A20 C0\nM2\n");
  const auto axis = [&](const Words& words) {
    return Vec3(session.kinematics->orientation(words.tail<3>()).col(2));
  };
  std::vector<ProgramMove> out(list.moves.begin() + 1, list.moves.end() - 1);
  ASSERT_GT(out.size(), 8u);
  EXPECT_TRUE(list.moves.back().to.isApprox(out.front().from)) << "ORIAXES: one move";
  const Vec3 from = axis(out.front().from), to = axis(out.back().to), normal = from.cross(to).normalized();
  const double angle = std::acos(from.dot(to));
  for (const ProgramMove& move : out)
    for (const double part : {0.25, 0.5, 0.75, 1.0}) {
      const Words at = move.from + part * (move.to - move.from);
      EXPECT_LT(std::abs(axis(at).dot(normal)), 5e-5);
      const double share = (at[kX] - out.front().from[kX]) / (out.back().to[kX] - out.front().from[kX]);
      EXPECT_NEAR(std::acos(from.dot(axis(at))), share * angle, 1e-4);
    }
  EXPECT_NEAR(out.back().to[kC], out.front().from[kC] + 70 * kRadPerDeg, 1e-12);
  expect_continuous(session, list);
}

// Through the pole the great circle ends on the other branch: the words go evenly, as programmed.
TEST(Lowering, GreatCircleKeepsTheProgrammedWords) {
  Session session = cradle();
  session.config.great_circle = true;
  const MoveList list =
      session.moves("G0 X20 Y30 Z100 A20 C0\nTRAORI\nG1 F1000 A20 C180\nA30 C180\nG61\nA20 C90\nM2\n");
  ASSERT_GE(list.moves.size(), 4u);
  EXPECT_NEAR(list.moves[1].to[kC], 180 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(list.moves.back().from[kC], 180 * kRadPerDeg, 1e-12) << "G61: one move";
  EXPECT_NEAR(list.moves.back().to[kC], 90 * kRadPerDeg, 1e-12);
}

TEST(Lowering, ToolVectors) {
  Session session = cradle();
  const MoveList list = session.moves("G43.5 H1\nG1 F100 X0 Y0 Z0 I0.3 J0.2 K0.9\nM2\n");
  ASSERT_EQ(list.moves.size(), 1u);
  const Vec3 u_W =
      list.moves[0].context.X_WB.R * session.kinematics->orientation(list.moves[0].to.tail<3>()).col(2);
  EXPECT_LT((u_W - Vec3(0.3, 0.2, 0.9).normalized()).norm(), 1e-9);
}

TEST(Lowering, TiltedPlane) {
  Session session = cradle();
  const MoveList list = session.moves(
      "G43 H1\nG0 X0 Y0 Z150\nG68.2 X10 Y20 Z5 I30 J25 K0\nG53.1\nG0 X0 Y0 Z50\nG1 F100 Z-3\nX7\nG69\nG0 "
      "Z150\nM2\n");
  expect_continuous(session, list);
  const ProgramMove& drill = list.moves[3];
  const Mat3 R = rot_z(rad_from_deg(30)) * rot_x(rad_from_deg(25));
  const Pose X_BM = session.kinematics->home_X_BM();
  const Vec3 tip_B = drill.to.head<3>();
  EXPECT_LT((tip_B - X_BM * Vec3(Vec3(10, 20, 5) + R * Vec3(0, 0, -3))).norm(), 1e-9);
  // the tool stands along the plane's Z
  EXPECT_LT((session.kinematics->orientation(drill.to.tail<3>()).col(2) - X_BM.R * R.col(2)).norm(), 1e-9);
}

TEST(Lowering, TiltedDrilling) {
  Session session = cradle();
  const MoveList list = session.moves("G43 H1\nG0 Z200\nF100 G183 X20 Y15 Z30 A10 C20 H-10 Q4 R3\nM2\n");
  expect_continuous(session, list);
  int feeds = 0;
  Vec3 deepest = Vec3::Zero();
  for (const ProgramMove& move : list.moves) {
    if (move.kind != ProgramMove::Kind::kFeed) continue;
    ++feeds;
    const Vec3 along = (move.to - move.from).head<3>();
    const Vec3 axis = session.kinematics->orientation(move.to.tail<3>()).col(2);
    EXPECT_LT(along.cross(axis).norm(), 1e-9) << "the hole is straight along the tool";
    deepest = session.kinematics->home_X_BM().R.transpose() * axis;
    deepest =
        Vec3(20, 15, 30) - 10 * deepest - inverse(session.kinematics->home_X_BM()) * Vec3(move.to.head<3>());
  }
  EXPECT_EQ(feeds, 4);
  EXPECT_LT(deepest.norm(), 1e-9);
}

TEST(Lowering, Feeds) {
  Session session;
  const MoveList list =
      session.moves("G1 F600 X10\nA90\nG20 F10 G1 X1\nG21 G93 G1 X0 F2\nS300 G95 F0.5 G1 X5\nG0 X9\nM2\n");
  EXPECT_DOUBLE_EQ(list.moves[0].feed.tip_mm_s, 10);
  EXPECT_EQ(list.moves[0].feed.rotary_rad_s, FeedLimit::kNone) << "F is the tip's where the tip moves";
  EXPECT_NEAR(list.moves[1].feed.rotary_rad_s, 10 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(list.moves[2].feed.tip_mm_s, 254.0 / 60, 1e-12);
  EXPECT_EQ(list.moves[2].duration_s, 0);
  EXPECT_NEAR(list.moves[3].duration_s, 30, 1e-12);
  EXPECT_EQ(list.moves[3].feed.tip_mm_s, FeedLimit::kNone);
  EXPECT_NEAR(list.moves[4].feed.tip_mm_s, 0.5 * 300 / 60, 1e-12);
  EXPECT_TRUE(list.moves[4].feed.overrides.per_turn);
  for (const std::size_t i : {0u, 3u}) EXPECT_FALSE(list.moves[i].feed.overrides.per_turn) << i;
  EXPECT_EQ(list.moves[5].feed.tip_mm_s, FeedLimit::kNone);
}

TEST(Lowering, ArcsEndWhereTheySay) {
  Session session;
  const MoveList list =
      session.moves("G10 L2 P1 X5 R30\nG1 F100 X0 Y0\nG2 X10 Y0 I5 J0 Z2\nG3 I3 P2\nG18 G3 X12 Z4 R2\nM2\n");
  for (const ProgramMove& move : list.moves) {
    if (move.kind != ProgramMove::Kind::kArc) continue;
    const PathPiece piece = make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad);
    EXPECT_LT((piece.at(piece.length) - move.to).norm(), 1e-9);
  }
  EXPECT_NEAR(std::abs(list.moves[2].arc_sweep_rad), 4 * kPi, 1e-9);
}

// Its ends add up to nothing, and yet they are two places.
TEST(Lowering, AHalfCircleAboutTheOriginIsNoFullOne) {
  Session session;
  const MoveList list = session.moves("G1 F100 X-10\nG2 X10 I10\nM2\n");
  EXPECT_NEAR(std::abs(list.moves.back().arc_sweep_rad), kPi, 1e-9);
}

TEST(Lowering, SmallArcGapsAreMendedWithAWarning) {
  Session session;
  const MoveList list = session.moves("G1 F100 X0\nG2 X10 I5.005\nM2\n");
  ASSERT_EQ(session.warnings.size(), 1u);
  EXPECT_EQ(session.warnings[0],
            "p.ngc:2:1: warning: the arc's end misses its circle by 0.0100 mm; the centre is moved to fit");
  EXPECT_NEAR(list.moves.back().arc_centre.x(), 5, 1e-12);
}

TEST(Lowering, SharedProgramsRunToTheEnd) {
  for (const char* name : {"boat-xyzac.ngc", "3D_Chips.ngc"}) {
    const std::string path = source_dir() + "/../shared/programs/" + name;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
    Session session = cradle();
    session.tools = ToolTable();
    MoveList list;
    Lowering lowering(session.config, session.kinematics.get(), list);
    Interpreter interpreter(
        {session.config, session.parameters, session.tools, session.kinematics.get(), lowering, {}});
    interpreter.open(path);
    while (interpreter.step()) {
    }
    EXPECT_GT(list.moves.size(), 1000u);
    expect_continuous(session, list);
  }
}

TEST(Tables, VariablesRoundTrip) {
  Parameters one;
  one[5221] = 1.25;
  one[5220] = 3;
  one[100] = 1.0 / 3;
  Parameters two;
  parse_parameters(parameters_text(one), "v.var", two);
  for (int n = 1; n <= parameter::kMax; ++n) EXPECT_EQ(one[n], two[n]) << n;
  EXPECT_THROW(parse_parameters("5221 x\n", "v.var", two), ProgramError);
  EXPECT_THROW(parse_parameters("5222 1\n5221 1\n", "v.var", two), ProgramError);
  try {
    parse_parameters("100 1\n9999 2\n", "v.var", two);
    FAIL();
  } catch (const ProgramError& error) {
    EXPECT_STREQ(error.what(), "v.var:2:1: there is no parameter number 9999");
  }
}

TEST(Tables, ToolsRoundTrip) {
  const ToolTable one = test::small_table();
  const ToolTable two = ToolTable::parse(one.to_text(), "t.tbl");
  EXPECT_EQ(one.to_text(), two.to_text());
  EXPECT_EQ(two.find(2)->offset[kZ], 80.5);
  EXPECT_EQ(two.find(3)->offset[kX], 1);
  try {
    ToolTable::parse("T1 P1\nT2 ?\n", "t.tbl");
    FAIL();
  } catch (const ProgramError& error) {
    EXPECT_STREQ(error.what(),
                 "t.tbl:2:4: unexpected character '?'; a tool is a line as 'T1 P1 Z50.5 D6 ;end mill'");
  }
}

TEST(Tables, OffsetsAreWrittenToTheVariables) {
  Session session;
  session.canon("G20 G10 L2 P2 X1 R15\nG0 X3\nG28.1\nG92 X0");
  EXPECT_DOUBLE_EQ(session.parameters[5241], 25.4);
  EXPECT_EQ(session.parameters[5250], 15);
  EXPECT_DOUBLE_EQ(session.parameters[5161], 3 * 25.4);
  EXPECT_DOUBLE_EQ(session.parameters[5211], 3 * 25.4);
}

TEST(Lowering, OutputsAreEventsOrPartOfTheNextMove) {
  const test::MoveList list =
      Session().moves("M62 P3\nM67 E1 Q2.5\nM63 P3\nM62 P63\nG0 X1\nM65 P4\nM68 E2 Q1.5\nM19 R90\nX2\nM2\n");
  using Kind = QueueEvent::Kind;
  ASSERT_EQ(list.events.size(), 5U);
  // M2 stops the spindle, which a typed line may have left on.
  const QueueEvent expected[] = {{Kind::kDigitalOutput, 0, 4},
                                 {Kind::kAnalogOutput, 1.5, 2},
                                 {Kind::kSpindleOrient, 90, 0},
                                 {Kind::kSpindle, 0, 0}};
  for (std::size_t i = 0; i < std::size(expected); ++i) {
    EXPECT_EQ(list.events[i].kind, expected[i].kind);
    EXPECT_EQ(list.events[i].argument, expected[i].argument);
    EXPECT_EQ(list.events[i].value, expected[i].value);
  }
  ASSERT_EQ(list.moves.size(), 2U);
  const OutputChanges& first = list.moves[0].outputs;
  EXPECT_EQ(first.set, std::uint64_t{1} << 63);
  EXPECT_EQ(first.clear, 8U);
  ASSERT_EQ(first.analog_count, 1);
  EXPECT_EQ(first.analog[0].index, 1);
  EXPECT_EQ(first.analog[0].value, 2.5);
  EXPECT_FALSE(list.moves[1].outputs.any());
}

// More analog changes than a move carries: the rest acts before it, at rest.
TEST(Lowering, NoSynchronisedOutputIsLost) {
  std::string program;
  for (int i = 0; i < 6; ++i) program += fmt::format("M67 E{} Q{}\n", i, i + 0.5);
  const test::MoveList list = Session().moves(program + "M67 E2 Q9\nG0 X1\nM2\n");
  ASSERT_EQ(list.moves.at(0).outputs.analog_count, 4);
  EXPECT_EQ(list.moves[0].outputs.analog[2].value, 9);
  EXPECT_EQ(list.events.at(0).value, 4.5);
  EXPECT_EQ(list.events.at(1).value, 5.5);
}

TEST(Lowering, ProbeMovesAndInputsAreBracketedByEvents) {
  Session session;
  session.config.io = true;
  const test::MoveList list = session.moves("F60 G38.5 Z-5\nM66 P7 L3 Q2\nM66 E1\nM2\n");
  using Kind = QueueEvent::Kind;
  ASSERT_GE(list.events.size(), 4U);
  EXPECT_EQ(list.events[0].kind, Kind::kProbeStart);
  EXPECT_EQ(static_cast<ProbeMode>(list.events[0].argument), ProbeMode::kTryRelease);
  EXPECT_EQ(list.events[1].kind, Kind::kProbeEnd);
  ASSERT_EQ(list.moves.size(), 1U);
  EXPECT_EQ(list.moves[0].feed.tip_mm_s, 1);
  EXPECT_EQ(list.events[2].value, 2);
  const InputArgument digital = InputArgument::unpack(list.events[2].argument);
  EXPECT_EQ(digital.index, 7);
  EXPECT_EQ(digital.wait, InputWait::kHigh);
  EXPECT_FALSE(digital.analog);
  EXPECT_TRUE(InputArgument::unpack(list.events[3].argument).analog);
}

// Spindle to its mark, gear closed, down, both at rest, up, gear open, spindle as before; no faster than the
// spindle can follow: 0.8 of 3000 rpm/s at 0.05 inch a turn.
TEST(Lowering, ATapGoesDownAndBackWithTheSpindle) {
  Session session;
  session.config.io = session.config.spindle_encoder = true;
  session.config.spindle_rpm_s = 3000;
  const test::MoveList list = session.moves("G20 G64 P1 S600 M4\nG0 X1\nG33.1 Z-0.5 K0.05\nG0 X2\nM2\n");
  using Kind = QueueEvent::Kind;
  std::vector<Kind> kinds;
  for (const QueueEvent& event : list.events) kinds.push_back(event.kind);
  EXPECT_EQ(kinds,
            (std::vector<Kind>{Kind::kSpindle, Kind::kSpindleOrient, Kind::kGearStart, Kind::kGearReverse,
                               Kind::kGearEnd, Kind::kSpindle, Kind::kSpindle, Kind::kProgramEnd}));
  EXPECT_EQ(list.events[2].value, -10) << "turns a second, M4";
  EXPECT_EQ(static_cast<GearMode>(list.events[2].argument), GearMode::kPathLeads);
  EXPECT_DOUBLE_EQ(list.events[2].per_turn_mm, 1.27);
  EXPECT_EQ(list.events[5].value, -600);
  ASSERT_EQ(list.moves.size(), 4U);
  EXPECT_DOUBLE_EQ(list.moves[1].to[2], -12.7);
  EXPECT_EQ(list.moves[2].to, list.moves[0].to);
  for (const std::size_t i : {1U, 2U}) {
    EXPECT_EQ(list.moves[i].mode, PathMode::kExactStop);
    EXPECT_DOUBLE_EQ(list.moves[i].feed.tip_mm_s, 12.7);
    EXPECT_DOUBLE_EQ(list.moves[i].feed.tip_mm_s2, 0.8 * 50 * 1.27);
  }
  EXPECT_EQ(list.moves[3].mode, PathMode::kContinuous);
  EXPECT_EQ(list.moves[3].feed.tip_mm_s2, FeedLimit::kNone);
}

// An offset of the tool in a rotary word shifts what the word means; the axis stays where it is.
TEST(Lowering, AToolsAngleTurnsNothing) {
  Session session;
  session.tools = ToolTable::parse("T1 P1 Z+50 A+30 D6\n", "t.tbl");
  const MoveList list = session.moves("G21 G90 G0 X1 A10\nT1 M6 G43\nG0 X5\nG0 A0\nG49\nG0 X6\nG0 A0\nM2\n");
  ASSERT_EQ(list.moves.size(), 5U);
  const double degree = kPi / 180;
  EXPECT_NEAR(list.moves[1].from[kA], 10 * degree, 1e-12);
  EXPECT_NEAR(list.moves[1].to[kA], 10 * degree, 1e-12) << "X alone";
  EXPECT_NEAR(list.moves[2].to[kA], 30 * degree, 1e-12) << "A0 of this tool";
  EXPECT_NEAR(list.moves[3].to[kA], 30 * degree, 1e-12);
  EXPECT_NEAR(list.moves[4].to[kA], 0, 1e-12);
  for (std::size_t i = 1; i < list.moves.size(); ++i)
    EXPECT_EQ(list.moves[i].from[kA], list.moves[i - 1].to[kA]) << "move " << i;
  Session five = cradle();
  five.tools = session.tools;
  EXPECT_EQ(five.error("G43.4 H1").substr(0, 60),
            "p.ngc:1:1: G43.4 is not built into this control: with an off");
}

// A typed line may have switched them on before the program; behind that nothing is told twice.
TEST(Lowering, TheFirstM5AndM9AreTold) {
  const MoveList list = Session().moves("M5 M9\nG0 X1\nM5 M9\nM8\nM8\nM9\nM2\n");
  using Kind = QueueEvent::Kind;
  std::vector<std::pair<Kind, int>> told;
  for (const QueueEvent& event : list.events) told.emplace_back(event.kind, event.argument);
  EXPECT_EQ(told, (std::vector<std::pair<Kind, int>>{{Kind::kSpindle, 0},
                                                     {Kind::kCoolant, 0},
                                                     {Kind::kCoolant, 2},
                                                     {Kind::kCoolant, 0},
                                                     {Kind::kProgramEnd, 1}}));
  const QueueEvent cut_off = Session().moves("G0 X1\n").events.back();
  EXPECT_EQ(cut_off.kind, Kind::kProgramEnd);
  EXPECT_EQ(cut_off.argument, 0) << "a file that just ends switches nothing";
}

// What needs to hear the machine is refused where it would move, and never becomes a plain feed.
TEST(Lowering, WhatNeedsInputsIsRefusedByName) {
  const auto refusal = [](const std::string& program) -> std::string {
    try {
      Session().moves(program + "\nM2\n");
    } catch (const GcodeError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_EQ(refusal("F9 G38.2 X5").substr(0, 76),
            "p.ngc:1:1: G38.2 is not built into this control: no probe input is connected");
  EXPECT_EQ(refusal("S9 M3\nG33 Z5 K1").substr(0, 79),
            "p.ngc:2:1: G33 is not built into this control: no spindle encoder is connected ");
  EXPECT_EQ(refusal("S9 M3\nG33.1 Z5 K1").substr(0, 14), "p.ngc:2:1: G33");
  EXPECT_EQ(refusal("M66 P1 L3 Q1").substr(0, 72),
            "p.ngc:1:1: M66 is not built into this control: no inputs are connected (");
}

// A digit too many: all of a curve's chords lie in memory at once.
TEST(Lowering, ASplineWithoutEndIsRefused) {
  const std::string digits = "222222222222";
  for (const std::string& curve : {"G5 X1 Y1 I0 J1 Q-3 P" + digits, "G5.1 X1 Y1 J1 I" + digits,
                                   "G5.2 X" + digits + " Y1 P1\nX9 Y" + digits + " P1\nX0 Y1 P1\nG5.3",
                                   "G6.2 P3 K0 X0 Y0 Z0\nK0 X" + digits + "\nK0 X0 Y9\nK1\nK1\nK1"}) {
    try {
      Session().moves("F9\n" + curve + "\nM2\n");
      ADD_FAILURE() << curve;
    } catch (const GcodeError& error) {
      EXPECT_NE(std::string(error.what()).find("the curve is longer than any machine"), std::string::npos)
          << error.what();
    }
  }
  EXPECT_GT(Session().moves("F9\nG5 X10 Y1 I0 J3 P10000000 Q1\nM2\n").moves.size(), 50'000U)
      << "nearly 10 km";
}

// A rational quadratic with these weights is a quarter of a circle.
TEST(Lowering, NurbsInSpaceAreTheirCurve) {
  const test::MoveList list = Session().moves(
      "G0 X10 Y0 Z3\nF100 G6.2 P3 K0 X10 Y0 Z3\nK0 X10 Y10 R[SQRT[0.5]]\nK0 X0 Y10\nK1\nK1\nK1\nM2\n");
  ASSERT_GT(list.moves.size(), 20U);
  for (const ProgramMove& move : list.moves) {
    EXPECT_NEAR(std::hypot(move.to[0], move.to[1]), 10, 2e-3);
    EXPECT_NEAR(move.to[2], 3, 1e-12);
  }
  EXPECT_NEAR(list.moves.back().to[1], 10, 1e-9);
}

// Basis functions by their recursive definition (Cox), weighted and summed.
double basis(const std::vector<double>& knots, std::size_t i, int order, double u) {
  if (order == 1) return knots[i] <= u && u < knots[i + 1] ? 1 : 0;
  const auto p = static_cast<std::size_t>(order) - 1;
  const double left = knots[i + p] - knots[i], right = knots[i + p + 1] - knots[i + 1];
  return (left > 0 ? (u - knots[i]) / left * basis(knots, i, order - 1, u) : 0) +
         (right > 0 ? (knots[i + p + 1] - u) / right * basis(knots, i + 1, order - 1, u) : 0);
}

TEST(Nurbs, PointsAreThoseOfTheBasisFunctions) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> place(-5, 5), weight(0.2, 3), step(0, 1);
  for (int order = 2; order <= 5; ++order) {
    NurbsCurve curve;
    curve.order = order;
    for (int i = 0; i < 7; ++i) curve.points.emplace_back(place(rng), place(rng), place(rng), weight(rng));
    double knot = 0;
    for (int i = 0; i < 7 + order; ++i) curve.knots.push_back(knot += i % 3 == 1 ? 0 : step(rng));
    for (int k = 0; k < 50; ++k) {
      const double u = curve.first() + (curve.last() - curve.first()) * k / 50;
      Eigen::Vector4d sum = Eigen::Vector4d::Zero();
      for (std::size_t i = 0; i < 7; ++i) {
        const double w = basis(curve.knots, i, order, u) * curve.points[i][3];
        sum += w * Eigen::Vector4d(curve.points[i][0], curve.points[i][1], curve.points[i][2], 1);
      }
      EXPECT_LT((curve.at(u) - Vec3(sum.head<3>() / sum[3])).norm(), 1e-9) << order << " " << u;
    }
  }
}

TEST(UserCodes, CallSubProgramsAndSwitchOutputs) {
  Session session;
  session.config.user_m = {{111, "touch", -1, true}, {112, "", 5, false}, {113, "", -1, true}};
  EXPECT_EQ(
      session.canon("o<touch> sub\nG0 X#1 Y#2\no<touch> endsub\nM111 P3 Q4\nM112\nM113 P1"),
      test::moves({"T 3 4 0", "CLEAR_AUX_OUTPUT_BIT(5)", "USER_DEFINED_FUNCTION(113, 1.000000, 0.000000)"}));
  const std::string called = "o<touch> sub\nG0 X[#1+1] Y[#2+1]\no<touch> endsub\n";
  EXPECT_EQ(session.canon(called + "M111 P3"), test::moves({"T 4 1 0"})) << "a word that is missing is 0";
  EXPECT_EQ(session.canon(called + "M111 Q3"), test::moves({"T 1 4 0"}));
}

// A quarter of a circle of 10 mm as a rational curve: chords miss it by 2 um, the cubic pieces by 1 um at
// most.
TEST(Lowering, ASplinesChordsStayBesideIt) {
  const test::MoveList list =
      Session().moves("G21 F9 G0 X10\nG5.2 P1 L3\nX10 Y10 P[SQRT[0.5]]\nX0 Y10 P1\nG5.3");
  int chords = 0;
  for (const ProgramMove& move : list.moves) {
    if (move.to[kY] <= 0) continue;
    const Vec3 from = move.from.head<3>(), to = move.to.head<3>();
    EXPECT_NEAR(to.norm(), 10, 1e-3);
    EXPECT_NEAR((from + to).norm() / 2, 10, 3e-3);
    ++chords;
  }
  EXPECT_LT(chords, 200) << "and are no more than that needs";
  EXPECT_GT(chords, 30);
}

// The second difference of the parabola (0, 0), (10, 9), (20, 0) is 18 mm, its bend 36 mm: n chords miss it
// by 36 / (8 n^2), which is 2.04 um for 47 of them and 1.95 um for 48.
TEST(Lowering, ASplineHasNoMoreChordsThanItNeeds) {
  EXPECT_EQ(Session().moves("G21 F9\nG5.1 X20 Y0 I10 J9").moves.size(), 48u);
}

}  // namespace
}  // namespace trn
