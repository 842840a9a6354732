#include "kernel/rate_follower.h"

#include <gtest/gtest.h>

#include "kernel/rate_plan.h"

namespace trn {
namespace {

constexpr double kPeriodS = 0.001;

RatePlan to_rest(double u, double time_s) {
  RatePlan plan;
  plan.steps[0] = {time_s, -u};
  plan.steps[1] = {time_s, u};
  plan.count = 2;
  plan.end_rate = 0;
  plan.stops = true;
  return plan;
}

TEST(RateFollower, BeginsWithoutARampAndNeverAbove100Percent) {
  RateFollower follower(kPeriodS);
  follower.restart(0.25);
  EXPECT_DOUBLE_EQ(follower.step(), 0.25 * kPeriodS);
  follower.restart(1.7);
  EXPECT_DOUBLE_EQ(follower.step(), kPeriodS) << "the path itself is the ramp, and knows no more than 100 %";
  follower.restart(0);
  EXPECT_EQ(follower.step(), 0);
  EXPECT_TRUE(follower.standing());
}

TEST(RateFollower, FollowsAPlanFromItsFirstStepOn) {
  RateFollower follower(kPeriodS);
  follower.restart(1);
  const RatePlan plan = to_rest(1e4, 0.01);
  follower.adopt(plan);
  double passed_s = 0;
  int periods = 0;
  for (; !follower.standing() && periods < 100; ++periods) passed_s += follower.step();
  EXPECT_EQ(periods, 20);
  EXPECT_NEAR(passed_s, 0.01, 1e-15);
}

// A second plan begins where the first one has come to, not where it began.
TEST(RateFollower, ANewPlanTakesOverRateAndSlope) {
  RateFollower follower(kPeriodS);
  follower.restart(1);
  follower.adopt(to_rest(1e4, 0.01));
  for (int i = 0; i < 5; ++i) follower.step();
  const double rate = follower.rate(), slope = follower.state().slope;
  EXPECT_LT(rate, 1);
  EXPECT_LT(slope, 0);
  RatePlan level;  // brings r' back to 0 and stays
  level.steps[0] = {0.01, -slope / 0.01};
  level.count = 1;
  level.end_rate = rate + slope * 0.01 / 2;
  follower.adopt(level);
  EXPECT_EQ(follower.state().rate, rate);
  EXPECT_EQ(follower.state().slope, slope);
  EXPECT_NEAR(follower.step(),
              kPeriodS * (rate + slope * kPeriodS / 2 - slope / 0.01 * kPeriodS * kPeriodS / 6), 1e-15);
  for (int i = 0; i < 20; ++i) follower.step();
  EXPECT_EQ(follower.rate(), level.end_rate);
}

TEST(RateFollower, TellsWhatPassedInPartOfTheLastPeriod) {
  RateFollower follower(kPeriodS);
  follower.restart(1);
  follower.adopt(to_rest(1e4, 0.01));
  for (int i = 0; i < 7; ++i) follower.step();
  const double whole = follower.step();
  EXPECT_EQ(follower.plan_time_at(0), 0);
  EXPECT_EQ(follower.plan_time_at(1), whole);
  const double first = follower.plan_time_at(0.5);
  EXPECT_GT(first, whole / 2) << "it slows down";
  EXPECT_LT(first, whole);
}

}  // namespace
}  // namespace trn
