#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "core/motion.h"
#include "core/units.h"
#include "tests/interp/gcode/run_program.h"

// M154 and M155: whether the spindle's drive is an axis.
namespace trn {
namespace {

test::Session mill() {
  test::Session session = test::shipped("spindle_axis");
  session.config.spindle_axis.rpm_max = 3000;  // of the joint
  return session;
}

TEST(SpindleIsAxis, StopsTurnsAndGoesOn) {
  const std::string text = mill().canon("G21 G94 S1000 M3\nM154\nG1 X10 C450 F500\nM155\nS500 M4\nM154");
  for (const char* part :
       {"STOP_SPINDLE_TURNING(0)\nSET_SPINDLE_AXIS(ON, ", "SET_SPINDLE_AXIS(OFF)\nSET_SPINDLE_SPEED",
        "STOP_SPINDLE_TURNING(0)\nSET_SPINDLE_AXIS(ON, -90.0000)\n"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  // Once more is no change.
  EXPECT_EQ(mill().canon("M155\nM154\nM154").find("(ON"), mill().canon("M155\nM154\nM154").rfind("(ON"));
}

TEST(SpindleIsAxis, TheMachineWaitsUntilItStandsThere) {
  const auto events = mill().moves("G21 G92 C10\nM154\nM155\nM2\n").events;
  ASSERT_GE(events.size(), 2u);
  EXPECT_EQ(events[0].kind, QueueEvent::Kind::kSpindleOrient);
  EXPECT_NEAR(events[0].value, 0, 1e-12);  // the machine's C, whatever the program calls it
  EXPECT_EQ(events[1].kind, QueueEvent::Kind::kSpindle);
  EXPECT_EQ(events[1].value, 0);
}

TEST(SpindleIsAxis, ASpindleIsNoAxisAndAnAxisNoSpindle) {
  const auto error = [](const std::string& program) { return mill().error("G21 G94 F500\n" + program); };
  EXPECT_NE(error("G1 X5 C90").find("p.ngc:2:7: a word C: it is a spindle now; M154 makes an axis of it"),
            std::string::npos)
      << error("G1 X5 C90");
  EXPECT_NE(error("G28").find("p.ngc:2:1: G28: C would move"), std::string::npos) << error("G28");
  EXPECT_NE(error("S100 M3\nG33.1 Z-1 K1").find("p.ngc:3:1: G33.1: tap with an axis: M154"),
            std::string::npos);
  EXPECT_EQ(error("G28 Z0\nG92 C0\nG10 L2 P1 C5"), "");
  for (const char* line : {"M3", "M4", "M19 R5", "S100", "G33 Z-1 K1", "G84 X1 Z-1 R1"}) {
    const std::string said = error(fmt::format("S100\nM154\n{}", line));
    EXPECT_NE(said.find("p.ngc:4:1:"), std::string::npos) << line << ": " << said;
    EXPECT_NE(said.find("the spindle is an axis now; M155 first"), std::string::npos) << line << ": " << said;
  }
  EXPECT_EQ(error("M154\nG1 C90\nM5\nM155\nS100 M3\nM19 R5\nM5"), "");
  EXPECT_NE(error("S3001 M3").find("3000 rpm at most"), std::string::npos) << error("S3001 M3");
}

TEST(SpindleIsAxis, EachProgramBeginsWithASpindle) {
  const std::string text = mill().canon("M154");
  EXPECT_NE(text.find("SET_SPINDLE_AXIS(ON, 0.0000)"), std::string::npos) << text;
  test::CanonText whole;
  mill().run("M154\nM2\n", whole);
  EXPECT_NE(whole.text.find("SET_SPINDLE_AXIS(OFF)"), std::string::npos);
}

}  // namespace
}  // namespace trn
