#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "app/check/limit_judge.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/fault.h"
#include "hal/loopback.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// A planner that cannot keep up: so many seconds of plan reach the queue in a period, and no more.
namespace trn {
namespace {

/// Many short blended moves of five axes, 0.2 mm each.
std::string waves() {
  std::string program = "G21 G94 G64 P0.01 F5000\nG90\n";
  char line[80];
  for (int i = 1; i <= 2500; ++i) {
    const double x = 0.2 * i;
    std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f A%.4f\n", x - 200, 20 * std::sin(x / 15), x / 20);
    program += line;
  }
  return program + "M2\n";
}

/// What the rate did in one phase of the run.
struct Rates {
  double least = 2, sum = 0;
  int count = 0;
  void see(double rate) {
    least = std::min(least, rate);
    sum += rate;
    ++count;
  }
  double mean() const { return sum / count; }
};

TEST(StarvedPlanner, SlowsOnThePathToThePlannersPaceAndNeverJerks) {
  const PlannedMotion motion(source_dir() + "/configs/cradle.toml", waves());
  const double T = motion.assembly().machine.period_s;
  MotionQueue queue(motion.blocks().size() + 1);
  LoopbackDrives drives(motion.q(0));
  Cycle cycle(cycle_config(motion.assembly(), ProgramStops::kPass),
              {*motion.assembly().map, queue, drives, *motion.assembly().rate_plans});
  cycle.tick();
  drives.bring_up();
  for (int i = 0; i < 3; ++i) cycle.tick();

  // Primed, then half the pace of the motion, then nothing for a while, then twice its pace.
  constexpr int kHalfFrom = 1500, kGoneFrom = 6000, kBackFrom = 10000;
  double ahead_s = motion.assembly().planner.buffer_s;
  std::size_t pushed = 0;
  const auto feed = [&] {
    while (pushed < motion.blocks().size() &&
           motion.begin_s(static_cast<std::uint32_t>(pushed) + 2) <= ahead_s)
      queue.push(motion.blocks()[pushed++]);
  };
  feed();
  cycle.post({RtCommand::Kind::kStart});
  JointJudge judge(motion.assembly().machine.joints, T);
  judge(cycle.last_report().q_setpoint);
  Rates half, gone;
  double before = 0, largest_step = 0;
  int periods = 0;
  for (; periods < 60000 && (periods < 3 || cycle.last_report().motion != MotionState::kRest); ++periods) {
    const bool is_gone = periods >= kGoneFrom && periods < kBackFrom;
    if (!is_gone) ahead_s += T * (periods < kBackFrom ? 0.5 : 2);
    feed();
    cycle.tick();
    const CycleReport& report = cycle.last_report();
    ASSERT_EQ(report.fault, Fault::kOk) << "period " << periods;
    judge(report.q_setpoint);
    if (periods > 1) largest_step = std::max(largest_step, std::abs(report.override_now - before));
    before = report.override_now;
    if (is_gone) gone.see(report.override_now);
    if (periods >= kHalfFrom && periods < kGoneFrom) half.see(report.override_now);
  }
  std::string where;
  const double worst = judge.worst(&where);
  std::printf(
      "%.2f s of plan took %.2f s; rate at half the pace: mean %.3f, least %.3f; least while the planner was "
      "gone %.2g; %u times late; worst ratio %.6f (%s)\n",
      motion.length_s(), periods * T, half.mean(), half.least, gone.least, cycle.last_report().starvations,
      worst, where.c_str());
  EXPECT_EQ(cycle.last_report().motion, MotionState::kRest);
  EXPECT_LE(worst, LimitJudge::kRatioMax);
  EXPECT_GT(cycle.last_report().starvations, 0u);
  EXPECT_GT(half.least, 0.25) << "it all but stopped though the planner went on";
  EXPECT_LT(gone.least, 0.05) << "the planner was gone, and the machine was not slow";
  EXPECT_LT(largest_step, 0.05) << "of the rate in a period";
}

/// The joints from the first movement on, `few_s` of the plan being in the queue at the start; the rest comes
/// `late_periods` later. Ends with the program.
struct Started {
  Started(const PlannedMotion& motion, double few_s, int late_periods)
      : queue(motion.blocks().size() + 1), drives(motion.q(0)) {
    Cycle cycle(cycle_config(motion.assembly(), ProgramStops::kPass),
                {*motion.assembly().map, queue, drives, *motion.assembly().rate_plans});
    cycle.tick();
    drives.bring_up();
    for (int i = 0; i < 3; ++i) cycle.tick();
    std::size_t pushed = 0;
    const auto feed = [&](double until_s) {
      while (pushed < motion.blocks().size() &&
             motion.begin_s(static_cast<std::uint32_t>(pushed) + 2) <= until_s)
        queue.push(motion.blocks()[pushed++]);
    };
    feed(few_s);
    cycle.post({RtCommand::Kind::kStart});
    for (int i = 0; i < 20000 && (i < 3 || cycle.last_report().motion != MotionState::kRest); ++i) {
      if (i >= late_periods) feed(1e9);
      cycle.tick();
      EXPECT_EQ(cycle.last_report().fault, Fault::kOk);
      const JointVec& q = cycle.last_report().q_setpoint;
      if (q != motion.q(0) && begun < 0) begun = i;
      if (begun >= 0) places.push_back(q);
    }
    told = cycle.last_report().starvations;
  }
  MotionQueue queue;
  LoopbackDrives drives;
  std::vector<JointVec> places;
  int begun = -1;  ///< period
  std::uint32_t told = 0;
};

// The planner thread is away for a moment between the first block and the others, as on a busy host behind a
// tool change. The motion is the one of `run`, a moment later.
TEST(StarvedPlanner, AStartWithLittleOfThePlanWaitsAndIsTheSameMotion) {
  const PlannedMotion motion(source_dir() + "/configs/cradle.toml", waves());
  const Started whole(motion, 1e9, 0);
  ASSERT_EQ(whole.told, 0u);
  for (const double few_s : {0.0, 0.02, 0.1, 0.3, 0.6})
    for (const int late_periods : {1, 3, 20, 200}) {
      const Started started(motion, few_s, late_periods);
      EXPECT_EQ(started.told, 0u) << few_s << " s, " << late_periods << " periods";
      EXPECT_GE(started.begun, whole.begun) << few_s;
      EXPECT_LE(started.begun, whole.begun + late_periods) << few_s;
      ASSERT_EQ(started.places, whole.places) << few_s << " s, " << late_periods << " periods";
    }
}

// One that takes longer is told, and the motion begins with what there is.
TEST(StarvedPlanner, AStartDoesNotWaitLongerThanASecondAndSaysSo) {
  const PlannedMotion motion(source_dir() + "/configs/cradle.toml", waves());
  const double T = motion.assembly().machine.period_s;
  const Started started(motion, 0.6, static_cast<int>(3 / T));
  EXPECT_NEAR(started.begun * T, 1, 0.05);
  EXPECT_GT(started.told, 0u);
  const Started nothing_yet(motion, 0, static_cast<int>(3 / T));
  EXPECT_NEAR(nothing_yet.begun * T, 3, 0.05);
  EXPECT_EQ(nothing_yet.told, 0u) << "a program may calculate before it moves";
}

// Its time runs though the planner has nothing to show.
TEST(StarvedPlanner, ADwellIsAsLongAsProgrammed) {
  const PlannedMotion motion(source_dir() + "/configs/cradle.toml", "G21 G4 P0.5\n" + waves());
  const double T = motion.assembly().machine.period_s;
  ASSERT_EQ(motion.blocks()[0].segment_count, 0) << "the dwell";
  const Started whole(motion, 1e9, 0), behind(motion, 0, static_cast<int>(0.4 / T));
  EXPECT_NEAR(whole.begun * T, 0.5, 0.02);
  EXPECT_EQ(behind.begun, whole.begun);
  ASSERT_EQ(behind.places, whole.places);
}

}  // namespace
}  // namespace trn
