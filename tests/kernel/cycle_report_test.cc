#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/motion.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/held_machine.h"

// What the tick tells of the rate at which the machine moves now.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

TEST(CycleReport, TheRateOfAJogIsTheFeedOverrideAndOneAtMost) {
  HeldMachine machine("mill", "G21 G90\nG1 X30 F3000\nM2\n");
  machine.tell({Kind::kOverride, 0.4});
  ASSERT_TRUE(machine.until([&] { return machine.now().speed_mm_s > 1; }));
  ASSERT_TRUE(machine.hold());
  EXPECT_EQ(machine.now().override_now, 0) << "it stands";
  machine.tell({Kind::kJog, 10, 0, 1});
  machine.run(20);
  ASSERT_EQ(machine.now().detour, DetourState::kJogs);
  EXPECT_EQ(machine.now().override_now, 0.4) << "a jog in a hold";
  ASSERT_TRUE(machine.until([&] { return machine.now().stands_in_hold; }));
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  ASSERT_TRUE(machine.ended());
  for (const double feed : {0.25, 1.0, 1.5}) {
    machine.tell({Kind::kOverride, feed});
    machine.tell({Kind::kJog, 10, 0, 0});
    machine.run(20);
    ASSERT_EQ(machine.now().motion, MotionState::kJogging);
    EXPECT_EQ(machine.now().override_now, std::min(1.0, feed)) << "a jog at rest";
    ASSERT_TRUE(machine.ended());
  }
}

// A program that begins elsewhere than the one before has ended does not move fast in its first period.
TEST(CycleReport, TheSpeedIsThatOfThePathAlsoInTheFirstPeriodOfAProgram) {
  HeldMachine machine("mill", "G21 G90\nG1 X10 F3000\nM2\n");
  ASSERT_TRUE(machine.until([&] { return machine.now().speed_mm_s > 1; }));
  ASSERT_TRUE(machine.ended());
  machine.tell({Kind::kJog, 40, 0, 1});
  ASSERT_TRUE(machine.until([&] { return machine.now().motion == MotionState::kJogging; }));
  ASSERT_TRUE(machine.ended());
  machine.start("G21 G90\nG1 X20 F3000\nM2\n");
  double fastest_mm_s = 0;
  ASSERT_TRUE(machine.until([&] {
    fastest_mm_s = std::max(fastest_mm_s, machine.now().speed_mm_s);
    return machine.now().motion == MotionState::kRest && fastest_mm_s > 1;
  }));
  EXPECT_GT(fastest_mm_s, 45);
  EXPECT_LT(fastest_mm_s, 51) << "F3000 is 50 mm/s";
}

// M1 waits for the operator where he has asked for that, and only then.
TEST(CycleReport, AnOptionalStopIsOneWhileTheOperatorWantsIt) {
  for (const bool wanted : {true, false}) {
    HeldMachine machine("mill", "G21 G90\nG1 X10 F3000\nM1\nX20\nM2\n");
    machine.tell({Kind::kOptionalStop, wanted ? 0.0 : 1.0});
    EXPECT_EQ(machine.now().optional_stop, !wanted);
    machine.tell({Kind::kOptionalStop, wanted ? 1.0 : 0.0});
    EXPECT_EQ(machine.now().optional_stop, wanted);
    ASSERT_TRUE(machine.until([&] {
      return machine.now().motion == MotionState::kPaused || machine.now().motion == MotionState::kRest;
    }));
    EXPECT_NEAR(machine.now().q_plan[0], wanted ? 10 : 20, 1e-9);
  }
}

// The program's planning waits for a tool, and for nothing else of these events.
TEST(CycleReport, TheProgramIsToldThatItsToolIsInAndOnce) {
  HeldMachine machine("mill", "G21 G90\nS100 M3\nG4 P0.1\nM8\nG1 X5 F3000\nM0\nT1 M6\nG1 X10\nM2\n");
  int answers = 0, pauses = 0;
  for (int i = 0; i < 20000 && answers == 0; ++i) {
    machine.tick();
    if (machine.now().motion == MotionState::kPaused && machine.now().stands_in_hold) {
      EXPECT_EQ(answers, 0);
      ++pauses;
      machine.tell({Kind::kResume});
    }
    if (!machine.now().answered) continue;
    ++answers;
    EXPECT_EQ(machine.now().event.kind, QueueEvent::Kind::kToolChange);
    EXPECT_EQ(machine.now().answer.value, 1);
    EXPECT_FALSE(machine.now().answer.probe);
  }
  EXPECT_EQ(answers, 1);
  EXPECT_EQ(pauses, 2) << "at M0 and at M6";
}

}  // namespace
}  // namespace trn
