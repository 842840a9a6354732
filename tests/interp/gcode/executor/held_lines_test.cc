#include <cmath>
#include <string>
#include <utility>

#include "core/axes.h"
#include "core/config.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/interp/gcode/run_program.h"

// What the operator sets while a program waits at a stop (Interpreter::obey_held).
namespace trn {
namespace {

using test::MoveList;
using test::Session;

/// A program that has been read up to and with one of its lines.
struct Held {
  Held(const std::string& program, std::uint32_t line, Session session_in = {})
      : session(std::move(session_in)) {
    interpreter.open_text(program, "p.ngc");
    while (interpreter.line() < line && interpreter.step()) {
    }
  }
  void obey(const std::string& text, std::array<double, 6> stands) {
    interpreter.obey_held({interpreter.blocks(), text, stands}, [] {});
  }
  const ProgramMove& next() {
    const std::size_t before = list.moves.size();
    while (list.moves.size() == before && interpreter.step()) {
    }
    return list.moves.back();
  }

  double next_z() {
    const ProgramMove& move = next();
    return move.to[kZ] + move.context.tool_offset[2];
  }

  Session session;
  MoveList list;
  Lowering lowering{session.config, session.kinematics.get(), list};
  Interpreter interpreter{
      {session.config, session.parameters, session.tools, session.kinematics.get(), lowering, {}, true}};
};

/// Where the spindle's gauge point goes with a tool along Z.
double spindle_z(const ProgramMove& move, const Words& words) {
  return words[kZ] + move.context.tool_offset[2];
}

// X10 and Z60 (50 of it the tool) is the place of the stop; touched off was elsewhere.
TEST(HeldLines, TouchingOffCountsFromWhereTheMachineStands) {
  Held held("G21 G90\nT1 M61 Q1 G43\nG1 X10 Z10 F600\nM0\nG1 X20 Z5\nM2\n", 4);
  held.obey("G10 L20 P0 X25", {15, 0, 40, 0, 0, 0});
  EXPECT_EQ(std::as_const(held.session.parameters)[5221], -10);
  const ProgramMove& move = held.next();
  EXPECT_DOUBLE_EQ(move.from[kX], 10) << "it goes on from the place of the stop";
  EXPECT_DOUBLE_EQ(move.to[kX], 10) << "to X20 of the new offset";
  EXPECT_DOUBLE_EQ(spindle_z(move, move.to), 55);
}

TEST(HeldLines, ALengthInForceIsInForceAnew) {
  Held held("G21 G90\nM61 Q1 G43\nG1 X10 Z10 F600\nM0\nG1 Z5\nM2\n", 4);
  held.obey("G10 L1 P1 Z47\n", {10, 0, 10, 0, 0, 0});
  EXPECT_DOUBLE_EQ(held.next_z(), 52);
  // By its tip at Z3, with the spindle at 90: the new offset counts from the old length's place.
  Held touched("G21 G90\nM61 Q1 G43\nG1 X10 Z10 F600\nM0\nG1 Z5\nM2\n", 4);
  touched.obey("G10 L10 P1 Z3", {10, 0, 40, 0, 0, 0});
  EXPECT_DOUBLE_EQ(touched.session.tools.find(1)->offset[2], 87);
  const ProgramMove& move = touched.next();
  EXPECT_DOUBLE_EQ(spindle_z(move, move.from), 60);
  EXPECT_DOUBLE_EQ(spindle_z(move, move.to), 92);
}

TEST(HeldLines, AnotherToolHasItsOwnLengthWhereOneWasInForce) {
  Held held("G21 G90\nM61 Q1 G43\nG1 Z10 F600\nM0\nG1 Z5\nM2\n", 4);
  held.obey("M61 Q2", {});
  EXPECT_EQ(std::as_const(held.session.parameters)[parameter::kTool], 2);
  EXPECT_DOUBLE_EQ(held.next_z(), 85.5);
  Held without("G21 G90\nM61 Q1 G49\nG1 Z10 F600\nM0\nG1 Z5\nM2\n", 4);
  without.obey("M61 Q2\nG10 L1 P2 Z60", {});
  EXPECT_DOUBLE_EQ(without.next_z(), 5) << "G49 stays";
  Held other("G21 G90\nM61 Q1 G43 H3\nG1 Z10 F600\nM0\nG1 Z5\nM2\n", 4);
  other.obey("G10 L1 P1 Z60", {});
  EXPECT_DOUBLE_EQ(other.next_z(), 35) << "the program took another length than the tool's own";
}

// With RTCP the tip goes to its place with the new length, wherever the table has turned it.
TEST(HeldLines, WithToolCentrePointControlTheTipGoesToItsPlace) {
  const std::string program =
      "G21 G90\nM61 Q1 G43.4\nG1 X5 Y0 Z20 A-20 C30 F600\nM0\nG1 X6 Y0 Z20 A-20 C30\nM2\n";
  Held held(program, 4, test::cradle());
  const ProgramMove before = held.list.moves.back();
  held.obey("G10 L1 P1 Z60", {});
  const ProgramMove& move = held.next();
  EXPECT_EQ(move.context.tool_offset[2], 60);
  EXPECT_GT((move.from - before.to).head<3>().norm(), 9) << "the tip of the longer tool stands elsewhere";
  Held plain("G21 G90\nM61 Q1 G43.4\nG1 X5 Y0 Z20 A-20 C30 F600\nG1 X6 Y0 Z20 A-20 C30\nM2\n", 3,
             test::cradle());
  EXPECT_NEAR((move.to - plain.next().to).norm(), 0, 1e-9) << "its next place is the programmed one";
  EXPECT_THROW(held.obey("G10 L10 P1 Z0", {}), GcodeError) << "one coordinate tells no length here";
}

TEST(HeldLines, WhatIsRefusedChangesNothing) {
  const std::string program = "G21 G90\nM61 Q1 G43\nG1 X10 Z10 F600\nM0\nG1 X20 Z5\nM2\n";
  for (const char* text : {"G10 L2 P1 X5\nG10 L10 P9 Z1", "G10 L2 P1 X5\nG0 X3", "G10 L1 P1 Z40\nM61 Q9",
                           "G10 L2 P1 X5\nG10 L20 X1", "G10 L2 P1 X#5220"}) {
    Held held(program, 4);
    EXPECT_THROW(held.obey(text, {10, 0, 10, 0, 0, 0}), GcodeError) << text;
    EXPECT_EQ(std::as_const(held.session.parameters)[5221], 0) << text;
    EXPECT_EQ(held.session.tools.find(1)->offset[2], 50) << text;
    const ProgramMove& move = held.next();
    EXPECT_DOUBLE_EQ(move.to[kX], 20) << text;
    EXPECT_DOUBLE_EQ(spindle_z(move, move.to), 55) << text;
  }
  Held held(program, 4);
  EXPECT_THROW(held.interpreter.obey_held({held.interpreter.blocks(), "G10 L2 P1 X5", {}},
                                          [] { throw ProgramError("the disk is full"); }),
               ProgramError);
  EXPECT_DOUBLE_EQ(held.next().to[kX], 20);
}

TEST(HeldLines, InACompensatedContourThereAreNone) {
  Held held("G21 G90\nM61 Q1\nG1 X0 Y0 F600\nG41.1 D2 G1 X10 Y1\nX20\nM0\nX30\nG40 Y9\nM2\n", 6);
  EXPECT_THROW(held.obey("G10 L1 P1 Z40", {}), GcodeError);
}

// As the session's log has them: a later reading of the program obeys them behind the same block.
TEST(HeldLines, AReplayObeysThemBehindTheSameBlock) {
  const std::string program = "G21 G90\nM61 Q1 G43\nG1 X10 Z10 F600\nM0\nG1 X20 Z5\nM2\n";
  Held live(program, 4);
  live.obey("G10 L20 P0 X25", {15, 0, 40, 0, 0, 0});
  Session session;
  session.config.held_lines = {{live.interpreter.blocks(), "G10 L20 P0 X25", {15, 0, 40, 0, 0, 0}}};
  const MoveList again = session.moves(program);
  live.next();
  ASSERT_EQ(again.moves.size(), live.list.moves.size());
  for (std::size_t i = 0; i < again.moves.size(); ++i)
    EXPECT_EQ(again.moves[i].to, live.list.moves[i].to) << i;
}

// A line of the program that names a tool which is not there is wrong; the operator's adds it.
TEST(HeldLines, TheOperatorAddsAToolToATableThatHasOthers) {
  Held held("G21 G90\nM61 Q1 G43\nG1 X10 Z10 F600\nM0\nG10 L1 P9 Z5\nM2\n", 4);
  held.obey("G10 L1 P9 Z33 R4 (8 mm ball)", {});
  const Tool* tool = held.session.tools.find(9);
  ASSERT_NE(tool, nullptr);
  EXPECT_EQ(tool->offset[2], 33);
  EXPECT_EQ(tool->diameter, 8);
  EXPECT_EQ(tool->pocket, 9) << "its number's pocket is free";
  EXPECT_EQ(tool->comment, "8 mm ball");
  held.obey("G10 L1 P9 H12", {});
  EXPECT_EQ(held.session.tools.find(9)->pocket, 12);
  EXPECT_EQ(held.session.tools.find(9)->comment, "8 mm ball") << "what is not named stays";
  EXPECT_THROW(held.obey("G10 L1 P9 H1", {}), GcodeError) << "another tool is there";
  EXPECT_THROW(held.obey("G10 L10 P7 Z0", {}), GcodeError) << "nothing to touch off";
  held.obey("G10 L1 P12 Z1", {});
  EXPECT_EQ(held.session.tools.find(12)->pocket, 4) << "12 is taken: the first that is free";
}

TEST(TypedLines, AddAToolAndAProgramDoesNot) {
  Session session;
  EXPECT_NE(session.error("G10 L1 P9 Z33").find("tool 9 is not in"), std::string::npos);
  session.config.typed = true;
  EXPECT_EQ(session.error("G10 L1 P9 Z33 (probe)"), "");
  ASSERT_NE(session.tools.find(9), nullptr);
  EXPECT_EQ(session.tools.find(9)->comment, "probe");
}

// It would go round for ever, and answer nobody.
TEST(TypedLines, M99IsRefused) {
  Session session;
  session.config.typed = true;
  EXPECT_NE(session.error("M99").find("what is typed runs once"), std::string::npos) << session.error("M99");
}

}  // namespace
}  // namespace trn
