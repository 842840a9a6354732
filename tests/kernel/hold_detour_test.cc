#include "kernel/hold_detour.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/axes.h"
#include "core/fault.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/held_machine.h"

// Jogs in a hold and the way back, through the whole tick.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

TEST(HoldDetour, ResumeLeadsBackToTheBitAndThePathIsTheUndisturbedOne) {
  HeldMachine undisturbed, machine;
  undisturbed.tick();
  ASSERT_TRUE(undisturbed.ended());
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  machine.post({Kind::kJog, 15, 0, 2});
  machine.run(30);
  ASSERT_TRUE(machine.jogged(0, -40));
  ASSERT_TRUE(machine.jogged(1, 12.5));
  EXPECT_EQ(machine.now().motion, MotionState::kHeld) << "the hold goes on";
  EXPECT_NEAR(machine.now().q_plan[0], q_hold[0] - 40, 1e-9);
  EXPECT_FALSE(machine.now().on_path);
  machine.tell({Kind::kResume});
  EXPECT_EQ(machine.now().motion, MotionState::kMoving);
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().q_plan, undisturbed.now().q_plan);
  EXPECT_LT(strays(machine.path(), undisturbed.path()), 0.001) << "chords of the arc's periods";
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  EXPECT_EQ(machine.allocations(), 0);
}

TEST(HoldDetour, TheWayBackObeysHoldAndOverride) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(4));
  const JointVec q_hold = machine.now().q_plan;
  ASSERT_TRUE(machine.jogged(1, 150));
  machine.tell({Kind::kResume});
  machine.run(200);
  const double fast = machine.now().q_plan[1];
  machine.run(100);
  const double way = std::abs(machine.now().q_plan[1] - fast);
  machine.tell({Kind::kOverride, 0.5});
  machine.run(500);
  const double slow = machine.now().q_plan[1];
  machine.run(100);
  EXPECT_NEAR(std::abs(machine.now().q_plan[1] - slow), way / 2, 1e-6);
  machine.tell({Kind::kHold});
  ASSERT_TRUE(machine.until([&] { return machine.now().stands_in_hold; }));
  EXPECT_EQ(machine.now().motion, MotionState::kHeld);
  const JointVec stands = machine.now().q_plan;
  machine.run(300);
  EXPECT_EQ(machine.now().q_plan, stands);
  EXPECT_GT((stands - q_hold).norm(), 1);
  ASSERT_TRUE(machine.jogged(0, 5)) << "away again, from there";
  machine.tell({Kind::kOverride, 0});
  machine.tell({Kind::kResume});
  machine.run(500);
  EXPECT_NEAR(machine.now().q_plan[0], stands[0] + 5, 1e-9) << "an override of 0 holds the way back too";
  machine.tell({Kind::kOverride, 1});
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
}

TEST(HoldDetour, AStopOnTheWayBackGivesTheProgramUp) {
  for (const bool jogs : {false, true}) {
    HeldMachine machine;
    ASSERT_TRUE(machine.held_at(4));
    ASSERT_TRUE(machine.jogged(1, 60));
    machine.tell(jogs ? RtCommand{Kind::kJog, 60, 0, 1} : RtCommand{Kind::kResume});
    machine.run(150);
    const JointVec before = machine.now().q_plan;
    machine.tell({Kind::kStop});
    EXPECT_EQ(machine.now().motion, MotionState::kMoving) << "it slows down";
    ASSERT_TRUE(machine.ended());
    EXPECT_GT((machine.now().q_plan - before).norm(), 0.01);
    EXPECT_EQ(machine.now().spindle_rpm, 0);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  }
}

TEST(HoldDetour, AnEmergencyStopForgetsTheWayBack) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(4));
  ASSERT_TRUE(machine.jogged(1, 60));
  machine.tell({Kind::kEmergencyStop});
  EXPECT_EQ(machine.now().motion, MotionState::kRest);
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
}

// The spindle needs its time to 3000 rpm; the machine waits in front of the last straight.
TEST(HoldDetour, SpindleAndCoolantAreAsTheProgramHadThemBeforeTheLastStraight) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  ASSERT_EQ(machine.now().spindle_rpm, 3000);
  machine.post({Kind::kCoolant, 0, 0, 0});
  machine.tell({Kind::kSpindle, 0});
  EXPECT_EQ(machine.now().spindle_rpm, 0);
  EXPECT_EQ(machine.now().coolant, 0);
  ASSERT_TRUE(machine.jogged(2, 20));
  ASSERT_TRUE(machine.until([&] { return machine.now().spindle_ready; }));
  machine.tell({Kind::kResume});
  EXPECT_EQ(machine.now().spindle_rpm, 3000);
  EXPECT_EQ(machine.now().coolant, 2);
  int waited = 0;
  while (machine.now().q_plan[2] > q_hold[2] + 19.999) {
    machine.tick();
    ++waited;
    ASSERT_LT(waited, 20000);
  }
  EXPECT_TRUE(machine.now().spindle_ready);
  EXPECT_GT(waited, 20);
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().fault, Fault::kOk);
}

TEST(HoldDetour, AtProgramStopsAndBetweenSingleBlocksToo) {
  HeldMachine stop("mill", "G21 G90\nG1 X10 F3000\nM0\nX20\nM2\n");
  ASSERT_TRUE(
      stop.until([&] { return stop.now().motion == MotionState::kPaused && stop.now().stands_in_hold; }));
  ASSERT_TRUE(stop.jogged(2, 30));
  EXPECT_EQ(stop.now().motion, MotionState::kPaused);
  stop.tell({Kind::kResume});
  ASSERT_TRUE(stop.until([&] { return stop.now().detour == DetourState::kNone; }));
  EXPECT_EQ(stop.now().q_plan[2], 0);
  EXPECT_LT(stop.now().q_plan[0], 10.001);
  ASSERT_TRUE(stop.ended());
  EXPECT_NEAR(stop.now().q_plan[0], 20, 1e-9);

  HeldMachine single;
  single.post({Kind::kSingleBlock, 1});
  for (int i = 0; i < 20 && single.now().q_plan[0] < 29; ++i) {
    single.tell({Kind::kResume});
    ASSERT_TRUE(single.until(
        [&] { return single.now().motion == MotionState::kPaused && single.now().stands_in_hold; }));
  }
  const JointVec q = single.now().q_plan;
  ASSERT_TRUE(single.jogged(0, 7));
  single.tell({Kind::kResume});
  ASSERT_TRUE(single.until([&] { return single.now().detour == DetourState::kNone; }));
  EXPECT_EQ(single.now().q_plan, q);
  EXPECT_EQ(single.now().motion, MotionState::kMoving) << "one resume is enough";
}

TEST(HoldDetour, NothingIsObeyedBeforeTheMachineStands) {
  HeldMachine machine;
  ASSERT_TRUE(machine.until([&] { return machine.now().line == 4 && machine.now().speed_mm_s > 10; }));
  machine.tell({Kind::kJog, 10, 0, 1});
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
  machine.post({Kind::kHold});
  machine.tell({Kind::kJog, 10, 0, 1});
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
  EXPECT_FALSE(machine.now().stands_in_hold);
}

class HeldConfigs : public testing::TestWithParam<std::string> {};

// Whatever the operator does in a hold, no joint passes a limit, and the machine comes back.
TEST_P(HeldConfigs, NothingThatTheOperatorDoesBreaksALimit) {
  std::string program = "G21 G94 G64 P0.02\nG91\n";
  for (int i = 0; i < 30; ++i) program += i % 2 ? "G1 F2000 X-4 Y3\n" : "G1 F2000 X4 Y-3\n";
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    std::uniform_int_distribution<int> pick(0, 9), wait(1, 120);
    HeldMachine machine(GetParam(), program + "M2\n");
    ASSERT_TRUE(machine.until([&] { return machine.now().speed_mm_s > 5; }));
    ASSERT_TRUE(machine.hold());
    const JointVec q_hold = machine.now().q_plan;
    std::uniform_int_distribution<int> joint(0, static_cast<int>(q_hold.size()) - 1);
    for (int i = 0; i < 40; ++i) {
      const int what = pick(rng);
      if (what < 6) machine.post({Kind::kJog, 3 * any(rng), 0, joint(rng)});
      if (what == 6) machine.post({Kind::kOverride, std::abs(any(rng))});
      if (what == 7) machine.post({Kind::kResume});
      if (what >= 8) machine.post({Kind::kHold});
      machine.run(wait(rng));
    }
    machine.post({Kind::kOverride, 1});
    const auto back = [&] { return machine.now().detour == DetourState::kNone && machine.now().line > 0; };
    machine.post({Kind::kResume});
    ASSERT_TRUE(machine.until(back, 60000));
    ASSERT_TRUE(machine.until([&] { return machine.now().motion == MotionState::kRest; }, 60000));
    EXPECT_EQ(machine.now().fault, Fault::kOk);
    EXPECT_GT(machine.returns(), 0);
    EXPECT_EQ(machine.wrong_returns(), 0);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  }
}

INSTANTIATE_TEST_SUITE_P(HoldDetour, HeldConfigs, testing::Values("mill", "cradle", "hexapod"));

}  // namespace
}  // namespace trn
