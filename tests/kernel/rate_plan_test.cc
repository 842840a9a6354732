#include "kernel/rate_plan.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/axes.h"

namespace trn {
namespace {

/// Down from rate 1 to `end` with the second derivative -u, then u, each for `time_s`: r falls by u time_s^2.
RatePlan falling(double u, double time_s, double end) {
  RatePlan plan;
  plan.steps[0] = {time_s, -u};
  plan.steps[1] = {time_s, u};
  plan.count = 2;
  plan.arrival = 2;
  plan.target = plan.end_rate = end;
  plan.stops = end == 0;
  return plan;
}

// The integral in closed form: by symmetry the mean rate of a fall is the mean of its ends.
TEST(RatePlan, PlanTimeIsTheIntegralOfTheRate) {
  const RatePlan plan = falling(2500, 0.02, 0);
  RateState state;
  EXPECT_NEAR(state.follow(plan, 0.04), 0.04 * 0.5, 1e-15);
  EXPECT_TRUE(state.standing());
  EXPECT_TRUE(state.plan_ended(plan));
  EXPECT_EQ(state.follow(plan, 1), 0) << "it stands";
}

TEST(RatePlan, HalfWayTheSlopeIsGreatest) {
  const RatePlan plan = falling(2500, 0.02, 0);
  RateState state;
  state.follow(plan, 0.02);
  EXPECT_NEAR(state.rate, 0.5, 1e-12);
  EXPECT_NEAR(state.slope, -50, 1e-9);
  EXPECT_EQ(state.next, 1) << "the first step is spent";
  EXPECT_EQ(state.spent_s, 0);
}

// Periods that end beside the steps' borders add up to the same, whatever their length.
TEST(RatePlan, IsFollowedTheSameInPartsOfAnyLength) {
  const RatePlan plan = falling(700, 0.03, 0.37);
  RateState whole;
  const double passed_s = whole.follow(plan, 0.1);
  for (const double part_s : {0.00025, 0.0011, 0.007, 0.0301}) {
    RateState state;
    double sum_s = 0, left_s = 0.1;
    for (; left_s > 1e-12; left_s -= part_s) sum_s += state.follow(plan, std::min(part_s, left_s));
    EXPECT_NEAR(sum_s, passed_s, 1e-14) << part_s;
    EXPECT_EQ(state.rate, whole.rate) << part_s;
    EXPECT_EQ(state.slope, 0) << part_s;
  }
}

// Steps add up to their target but for rounding; where they arrive the rate is the target to the bit.
TEST(RatePlan, ArrivesExactly) {
  RatePlan plan = falling(0.1, 1.0 / 3, 1 - 0.1 / 9);
  plan.steps[2] = {0.5, 0};
  plan.count = 3;
  RateState state;
  state.follow(plan, 2.0 / 3 + 0.1);
  EXPECT_EQ(state.rate, plan.target);
  EXPECT_EQ(state.slope, 0);
  EXPECT_EQ(state.next, 2);
  EXPECT_NEAR(plan.time_s(state.next), 0.5, 1e-15);
  EXPECT_NEAR(plan.time_s(0), 2.0 / 3 + 0.5, 1e-15);
}

TEST(RatePlan, ACopyIsFollowedToTheSameBits) {
  const RatePlan plan = falling(1234.5, 0.021, 0.4556055);
  RatePlan copy;
  copy.count = 200;
  copy.at_place = true;
  copy.copy_from(plan);
  EXPECT_EQ(copy.count, plan.count);
  EXPECT_EQ(copy.arrival, plan.arrival);
  EXPECT_EQ(copy.target, plan.target);
  EXPECT_EQ(copy.end_rate, plan.end_rate);
  EXPECT_EQ(copy.level_rate, plan.level_rate);
  EXPECT_EQ(copy.stops, plan.stops);
  EXPECT_EQ(copy.at_place, plan.at_place);
  RateState a, b;
  for (int i = 0; i < 60; ++i) EXPECT_EQ(a.follow(plan, 0.001), b.follow(copy, 0.001));
}

// A lead is 2 ms of whole periods, and at least one.
TEST(RatePlan, ALeadIsTwoMillisecondsInWholePeriods) {
  EXPECT_EQ(rate_lead_periods(0.001), 2);
  EXPECT_EQ(rate_lead_periods(0.00025), 8);
  EXPECT_EQ(rate_lead_periods(0.002), 1);
  EXPECT_EQ(rate_lead_periods(0.01), 1);
}

// A joint at full speed with jerk ramps on both sides: v/a + a/j. Twice that is looked at.
TEST(RatePlan, AStopTakesTwiceTheSlowestJointsOwn) {
  Joint quick, slow;
  quick.limit = {.velocity = 100, .acceleration = 1000, .jerk = 20000};
  slow.limit = {.velocity = 50, .acceleration = 100, .jerk = 1000};
  EXPECT_DOUBLE_EQ(plan_stop_s({quick}), 2 * (0.1 + 0.05));
  EXPECT_DOUBLE_EQ(plan_stop_s({quick, slow}), 2 * (0.5 + 0.1));
  EXPECT_DOUBLE_EQ(stop_horizon_s(1.2, 0.3), 2.4);
  EXPECT_DOUBLE_EQ(stop_horizon_s(1.2, 1.5), 3.6);
}

}  // namespace
}  // namespace trn
