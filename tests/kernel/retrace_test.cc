#include "kernel/retrace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/held_machine.h"

// Back along the path in a hold, and forward again, through the whole tick.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

constexpr double kAll_mm = 1e9;

/// What it drives along the path until it stands again.
std::vector<JointVec> retraced(HeldMachine& machine, double way_mm) {
  std::vector<JointVec> way;
  machine.tell({Kind::kRetrace, way_mm});
  for (int i = 0; i < 60000 && !machine.now().stands_in_hold; ++i) {
    way.push_back(machine.now().q_plan);
    machine.tick();
  }
  EXPECT_TRUE(machine.now().stands_in_hold);
  return way;
}

TEST(Retrace, ItGoesBackByTheWayAskedForAndForwardToTheBit) {
  HeldMachine undisturbed, machine;
  undisturbed.tick();
  ASSERT_TRUE(undisturbed.ended());
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  const std::vector<JointVec> back = retraced(machine, -12.5);
  EXPECT_NEAR(machine.now().behind_mm, 12.5, 1e-3);
  EXPECT_GT((machine.now().q_plan - q_hold).norm(), 5);
  EXPECT_LT(strays(back, undisturbed.path()), 0.001);
  EXPECT_EQ(machine.now().motion, MotionState::kHeld);
  EXPECT_TRUE(machine.now().on_path);
  retraced(machine, 4);
  EXPECT_NEAR(machine.now().behind_mm, 8.5, 1e-3);
  EXPECT_FALSE(machine.now().behind_end);
  retraced(machine, kAll_mm);
  EXPECT_EQ(machine.now().q_plan, q_hold);
  EXPECT_EQ(machine.now().behind_mm, 0);
  EXPECT_TRUE(machine.now().behind_end) << "no farther than it had come";
  EXPECT_EQ(retraced(machine, 3).size(), 0U);
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().q_plan, undisturbed.now().q_plan);
  EXPECT_LT(strays(machine.path(), undisturbed.path()), 0.001);
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  EXPECT_EQ(machine.allocations(), 0);
  EXPECT_EQ(machine.now().fault, Fault::kOk);
}

TEST(Retrace, ResumeGoesOnFromWhereItStands) {
  HeldMachine undisturbed, machine;
  undisturbed.tick();
  ASSERT_TRUE(undisturbed.ended());
  ASSERT_TRUE(machine.held_at(6));
  const std::size_t until_hold = machine.path().size();
  const std::vector<JointVec> back = retraced(machine, -20);
  const JointVec q_back = machine.now().q_plan;
  EXPECT_LE(machine.now().line, 6U);
  machine.tell({Kind::kResume});
  EXPECT_EQ(machine.now().behind_mm, 0);
  machine.run(20);
  EXPECT_LT((machine.now().q_plan - q_back).norm(), 2) << "from there, without a jump";
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().q_plan, undisturbed.now().q_plan);
  EXPECT_LT(strays(machine.path(), undisturbed.path()), 0.001);
  std::vector<JointVec> again(machine.path().begin() + static_cast<std::ptrdiff_t>(until_hold),
                              machine.path().end());
  EXPECT_LT(strays(back, again), 0.005) << "what was retraced is driven once more";
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
}

TEST(Retrace, ItEndsAtTheLastEventAndAtAnOutput) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  retraced(machine, -kAll_mm);
  EXPECT_TRUE(machine.now().behind_end);
  EXPECT_NEAR(machine.now().q_plan.norm(), 0, 1e-9) << "behind M8: the beginning of the path";
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.ended());

  HeldMachine output("mill", "G21 G90 G61\nG1 X10 F3000\nM62 P1\nX20\nX60\nM2\n");
  ASSERT_TRUE(output.held_at(5));
  retraced(output, -kAll_mm);
  EXPECT_TRUE(output.now().behind_end);
  EXPECT_NEAR(output.now().q_plan[0], 10, 1e-6) << "where the output was set";
}

TEST(Retrace, AtAProgramStopItComesBackToTheStop) {
  HeldMachine machine("mill", "G21 G90\nG1 X10 F3000\nM0\nX20\nM2\n");
  const auto paused = [&] {
    return machine.now().motion == MotionState::kPaused && machine.now().stands_in_hold;
  };
  ASSERT_TRUE(machine.until(paused));
  retraced(machine, -4);
  EXPECT_NEAR(machine.now().q_plan[0], 6, 1e-3);
  EXPECT_EQ(machine.now().motion, MotionState::kHeld);
  retraced(machine, kAll_mm);
  EXPECT_TRUE(paused());
  EXPECT_EQ(machine.now().waits_at.kind, QueueEvent::Kind::kProgramStop);
  EXPECT_EQ(machine.now().line, 3U);
  retraced(machine, -4);
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.until([&] { return machine.now().speed_mm_s > 1; }));
  ASSERT_TRUE(machine.until(paused)) << "the stop stands on the way";
  EXPECT_NEAR(machine.now().q_plan[0], 10, 1e-9);
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.ended());
  EXPECT_NEAR(machine.now().q_plan[0], 20, 1e-9);
}

TEST(Retrace, HoldAndFeedZeroStopItAndResumeWaitsForTheRest) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  machine.tell({Kind::kRetrace, -kAll_mm});
  machine.run(200);
  EXPECT_EQ(machine.now().detour, DetourState::kRetraces);
  machine.tell({Kind::kOverride, 0});
  machine.run(400);
  const JointVec q = machine.now().q_plan;
  machine.run(100);
  EXPECT_EQ(machine.now().q_plan, q);
  EXPECT_EQ(machine.now().detour, DetourState::kRetraces);
  machine.tell({Kind::kOverride, 1});
  machine.run(100);
  EXPECT_NE(machine.now().q_plan, q);
  machine.tell({Kind::kHold});
  ASSERT_TRUE(machine.until([&] { return machine.now().stands_in_hold; }));
  EXPECT_FALSE(machine.now().behind_end);
  machine.tell({Kind::kRetrace, -kAll_mm});
  machine.run(150);
  machine.tell({Kind::kResume});
  ASSERT_TRUE(machine.ended()) << "it turns round by itself";
  EXPECT_EQ(machine.now().fault, Fault::kOk);
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
}

TEST(Retrace, AStopInTheMiddleGivesTheProgramUp) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  machine.tell({Kind::kRetrace, -kAll_mm});
  machine.run(200);
  machine.tell({Kind::kStop});
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().spindle_rpm, 0);
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
}

class RetracedConfigs : public testing::TestWithParam<std::string> {};

// Blended corners at full speed, in both directions, with jogs, overrides and stops wherever chance has them.
TEST_P(RetracedConfigs, NothingThatTheOperatorDoesBreaksALimit) {
  std::string program = "G21 G94 G64 P0.02\nG91\n";
  for (int i = 0; i < 120; ++i) program += i % 2 ? "G1 F4000 X-4 Y3\n" : "G1 F4000 X4 Y-3.1\n";
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    std::uniform_int_distribution<int> pick(0, 9), wait(1, 200);
    HeldMachine undisturbed(GetParam(), program + "M2\n"), machine(GetParam(), program + "M2\n");
    undisturbed.tick();
    ASSERT_TRUE(undisturbed.ended());
    ASSERT_TRUE(machine.until([&] { return machine.now().line > 12 && machine.now().speed_mm_s > 5; }));
    ASSERT_TRUE(machine.hold());
    int moved = 0;
    for (int i = 0; i < 60 && machine.now().motion != MotionState::kRest; ++i) {
      const int what = pick(rng);
      if (what < 5) machine.post({Kind::kRetrace, 15 * any(rng)});
      if (what == 5) machine.post({Kind::kOverride, std::abs(any(rng))});
      if (what == 6) machine.post({Kind::kJog, any(rng), 0, 0});
      if (what == 7) machine.post({Kind::kResume});
      if (what >= 8) machine.post({Kind::kHold});
      machine.run(wait(rng));
      moved += machine.now().detour == DetourState::kRetraces;
    }
    EXPECT_GT(moved, 3);
    machine.tell({Kind::kOverride, 1});
    machine.until([&] { return machine.now().stands_in_hold; }, 3000);
    machine.tell({Kind::kResume});
    ASSERT_TRUE(machine.until([&] { return machine.now().motion == MotionState::kRest; }, 60000));
    EXPECT_EQ(machine.now().fault, Fault::kOk);
    EXPECT_EQ(machine.now().q_plan, undisturbed.now().q_plan);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
    EXPECT_EQ(machine.allocations(), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, RetracedConfigs, testing::Values("mill", "cradle", "head", "hexapod"));

// The writer leaves what may be retraced, however far it is ahead.
TEST(Retrace, TheQueueKeepsThePast) {
  MotionQueue queue(16, std::pmr::get_default_resource(), 8);
  MotionBlock block;
  block.segment_count = 1;
  std::uint32_t made = 0, taken = 0;
  for (int i = 0; i < 100; ++i) {
    block.source.line = made + 1;
    while (queue.push(block)) block.source.line = ++made + 1;
    queue.look();
    EXPECT_LE(made - taken, 8U);
    const std::uint64_t front = queue.front_number();
    for (std::uint64_t back = 0; back <= 6 && back <= front; ++back) {
      ASSERT_NE(queue.kept(front - back), nullptr);
      EXPECT_EQ(queue.kept(front - back)->source.line, front - back + 1);
    }
    if (i == 50) {
      queue.go_to(front - 6, true);
      EXPECT_EQ(queue.front()->source.line, front - 5);
      EXPECT_EQ(queue.kept(front - 7), nullptr) << "it may be no longer there";
      EXPECT_FALSE(queue.push(block));
      for (int k = 0; k < 6; ++k) queue.pop();
      EXPECT_EQ(queue.front_number(), front);
    }
    queue.pop();
    ++taken;
  }
}

}  // namespace
}  // namespace trn
