#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "kernel/hold_detour.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/held_machine.h"

// What a hold means to the tick: when the machine counts as standing, and what does not go on meanwhile.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

TEST(CycleHold, ItStandsWhenTheSetpointsHaveStoodForSomePeriods) {
  for (const std::uint32_t line : {4u, 6u}) {
    HeldMachine machine;
    ASSERT_TRUE(machine.until([&] { return machine.now().line == line && machine.now().speed_mm_s > 1; }));
    machine.post({Kind::kHold});
    JointVec last = machine.now().q_plan;
    int still = 0;
    for (int i = 0; i < 20000 && !machine.now().stands_in_hold; ++i) {
      machine.tick();
      still = machine.now().q_plan == last ? still + 1 : 0;
      last = machine.now().q_plan;
    }
    ASSERT_TRUE(machine.now().stands_in_hold);
    EXPECT_GE(still, kStillPeriods) << line;
  }
}

// G4 P1 is a second of the program's own time, which stands in a hold.
TEST(CycleHold, ADwellDoesNotGoOnMeanwhile) {
  constexpr int kHeld = 3000, kRamps = 300;  // periods
  const auto lasts = [](int held) {
    HeldMachine machine("mill", "G21 G90\nG1 X5 F3000\nG4 P1\nG1 X10\nM2\n");
    int periods = 0;
    const auto run = [&](int count) {
      machine.run(count);
      periods += count;
    };
    while (machine.now().q_plan[0] < 5 - 1e-9 && periods < 20000) run(1);
    run(100);
    if (held > 0) {
      machine.post({Kind::kHold});
      run(held);
      EXPECT_EQ(machine.now().motion, MotionState::kHeld);
      EXPECT_NEAR(machine.now().q_plan[0], 5, 1e-9);
      machine.post({Kind::kResume});
    }
    while (machine.now().motion != MotionState::kRest && periods < 40000) run(1);
    EXPECT_NEAR(machine.now().q_plan[0], 10, 1e-6);
    return periods;
  };
  EXPECT_NEAR(lasts(kHeld), lasts(0) + kHeld, kRamps);
}

// The way back is kept corner by corner. Where no more fit in, a jog is not obeyed, and the way back is still
// known.
TEST(CycleHold, AJogWithoutRoomForItsWayBackIsNotObeyed) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  int jogs = 0;
  for (bool moved = true; moved && jogs < 400; ++jogs) {
    const JointVec before = machine.now().q_plan;
    machine.tell({Kind::kJog, -0.5, 0, jogs % 2});  // a staircase
    machine.run(20);
    moved = machine.now().q_plan != before;
    ASSERT_TRUE(machine.until([&] { return machine.now().stands_in_hold; }));
  }
  EXPECT_GT(jogs, 100);
  EXPECT_LT(jogs, 256) << "it is obeyed for ever";
  EXPECT_EQ(machine.now().fault, Fault::kOk);
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }, 200000));
  EXPECT_EQ(machine.now().q_plan, q_hold);
}

// Behind M422 the joints go to where the next line has them without the correction. A stop meanwhile lets
// them slow down.
TEST(CycleHold, AStopWhileACorrectionIsSwitchedKeepsTheLimits) {
  int moved = 0;
  for (const int delay : {2, 6, 12, 20}) {
    HeldMachine machine("cradle_measured", "G21 G90 G61\nG1 X60 Y40 F6000\nM422\nG1 X90\nM2\n");
    ASSERT_TRUE(machine.until([&] { return machine.now().event.kind == QueueEvent::Kind::kCorrection; }));
    const JointVec q = machine.now().q_plan;
    machine.run(delay);
    moved += machine.now().q_plan != q;
    machine.post({Kind::kStop});
    ASSERT_TRUE(machine.ended());
    EXPECT_LT((machine.now().q_plan - q).head<3>().norm(), 1) << "it went on with the program";
    machine.run(5);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where << ", stopped after " << delay;
    EXPECT_EQ(machine.now().fault, Fault::kOk);
  }
  EXPECT_GT(moved, 2);
}

// At 2 % the joints come to rest long before they are there, and the program ends there.
TEST(CycleHold, AStopWhileACorrectionIsSwitchedSlowlyEndsOnTheWay) {
  HeldMachine machine("cradle_measured", "G21 G90 G61\nG1 X60 Y40 F6000\nM422\nG1 X90\nM2\n");
  ASSERT_TRUE(machine.until([&] { return machine.now().event.kind == QueueEvent::Kind::kCorrection; }));
  const JointVec q = machine.now().q_plan;
  machine.post({Kind::kOverride, 0.02});
  machine.run(60);
  EXPECT_NE(machine.now().q_plan, q) << "it is under way";
  machine.post({Kind::kStop});
  EXPECT_TRUE(machine.until([&] { return machine.now().motion == MotionState::kRest; }, 2000));
}

}  // namespace
}  // namespace trn
