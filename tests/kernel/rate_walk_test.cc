#include "kernel/rate/rate_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/motion.h"
#include "kernel/rate_plan.h"
#include "tests/kernel/rate_bench.h"

namespace trn {
namespace {

// A joint at a steady 50 mm/s may take u up to J / v and a slope up to A / v.
TEST(RateWalk, BoundsAtASteadySpeed) {
  RateRoad road(joint_block({{1, 50}}));
  const RateBounds bounds = road.walk(1, 0).bounds();
  EXPECT_TRUE(bounds.legal);
  EXPECT_LE(bounds.u_max, kJerkMax / 50);
  EXPECT_GE(bounds.u_max, 0.99 * kJerkMax / 50);
  EXPECT_LE(bounds.slope_max, kAccel / 50);
  EXPECT_GE(bounds.slope_max, 0.99 * kAccel / 50);
  EXPECT_DOUBLE_EQ(bounds.u_min, -bounds.u_max);
  EXPECT_DOUBLE_EQ(bounds.slope_min, -bounds.slope_max);
}

// |r^2 a + w v| <= A and |r^3 j + 3 r w a + u v| <= J, solved for w and u by hand.
TEST(RateWalk, SeededBoundsAreNeverWiderThanTheLimitsAndHardlyNarrower) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  int judged = 0;
  for (int i = 0; i < 3000; ++i) {
    const double v = 90 * unit(rng), a = 900 * unit(rng), j = 0.9 * kJerkMax * unit(rng);
    const double r = std::abs(unit(rng)), w = 5 * unit(rng);
    if (std::abs(v) < 5) continue;  // the error of the speed counts there
    RateRoad road(joint_block({{1e-3, v, a, j}}));
    const RateBounds bounds = road.walk(r, w).bounds();
    const double held = r * r * a, jerk = r * r * r * j + 3 * r * w * a;
    const double slope_max = ((v > 0 ? kAccel : -kAccel) - held) / v,
                 slope_min = ((v > 0 ? -kAccel : kAccel) - held) / v;
    const double u_max = ((v > 0 ? kJerkMax : -kJerkMax) - jerk) / v,
                 u_min = ((v > 0 ? -kJerkMax : kJerkMax) - jerk) / v;
    const double slack = 0.01 * kAccel / std::abs(v), u_slack = 0.02 * kJerkMax / std::abs(v);
    EXPECT_LE(bounds.slope_max, slope_max + 1e-9) << i;
    EXPECT_GE(bounds.slope_max, slope_max - slack) << i;
    EXPECT_GE(bounds.slope_min, slope_min - 1e-9) << i;
    EXPECT_LE(bounds.slope_min, slope_min + slack) << i;
    if (!bounds.legal) continue;
    ++judged;
    EXPECT_LE(bounds.u_max, std::min(u_max, road.limits.u_max) + 1e-9) << i;
    EXPECT_GE(bounds.u_max, std::min(u_max, road.limits.u_max) - u_slack) << i;
    EXPECT_GE(bounds.u_min, std::max(u_min, -road.limits.u_max) - 1e-9) << i;
    EXPECT_LE(bounds.u_min, std::max(u_min, -road.limits.u_max) + u_slack) << i;
  }
  EXPECT_GT(judged, 1000);
}

TEST(RateWalk, AStepIsTheIntegralOfItsU) {
  RateRoad road(joint_block({{1, 50}}));
  RateWalk walk = road.walk(0.8, -2);
  const double u = 100, t = walk.step(u, 1e-3);
  ASSERT_GT(t, 0);
  EXPECT_NEAR(walk.rate(), 0.8 - 2 * t + u * t * t / 2, 1e-15);
  EXPECT_NEAR(walk.slope(), -2 + u * t, 1e-12);
  EXPECT_NEAR(walk.passed_s(), 0.8 * t - t * t + u * t * t * t / 6, 1e-15);
}

// From rate 1 with slope 0 a u of -100 needs t with t - 100 t^3 / 6 = 0.002 to the segment's end.
TEST(RateWalk, AStepEndsWithItsSegment) {
  RateRoad road(joint_block({{0.002, 50}, {1, 50}}));
  RateWalk walk = road.walk(1, 0);
  double t = 0;
  while (walk.passed_s() < 0.002 - 1e-9) {
    const double gone = walk.step(-100, 1);
    ASSERT_GT(gone, 0);
    t += gone;
  }
  EXPECT_NEAR(walk.passed_s(), 0.002, 1e-12);
  EXPECT_NEAR(t - 100 * t * t * t / 6, 0.002, 1e-11);
  EXPECT_NEAR(walk.rate(), 1 - 50 * t * t, 1e-12);
}

TEST(RateWalk, AStepThatBreaksALimitIsRefused) {
  RateRoad road(joint_block({{1, 50}}));
  const RateBounds bounds = road.walk(1, 0).bounds();
  EXPECT_GT(road.walk(1, 0).step(0.999 * bounds.u_min, 1e-4), 0);
  EXPECT_LT(road.walk(1, 0).step(1.001 * bounds.u_min, 1e-4), 0) << "jerk";
  EXPECT_LT(road.walk(1, 1.001 * bounds.slope_min).step(0, 1e-4), 0) << "acceleration";
  EXPECT_LT(road.walk(0.001, -1.5).step(0, 1e-3), 0) << "never backwards";
}

TEST(RateWalk, AboveRateOneTheSpeedLimitCounts) {
  RateRoad road(joint_block({{1, 50}}));
  EXPECT_TRUE(road.walk(1.99, 0).bounds().legal);
  EXPECT_FALSE(road.walk(2.01, 0).bounds().legal);
}

TEST(RateWalk, RapidsAndMovesWithoutOverrideGoAsPlannedAtMost) {
  MotionBlock rapid = joint_block({{1, 20}}), fixed = rapid;
  rapid.rapid = true;
  fixed.overrides.feed = false;
  for (const MotionBlock* each : {&rapid, &fixed}) {
    const MotionBlock& block = *each;
    RateRoad road(block);
    EXPECT_GT(road.walk(1, 0).step(0, 1e-3), 0);
    EXPECT_LT(road.walk(1.01, 0).step(0, 1e-3), 0);
    std::vector<MotionBlock> late(2, block);
    late[0] = joint_block({{0.001, 20}});
    RateRoad before(late);
    EXPECT_LT(before.walk(1.01, 0).step(0, 0.002), 0) << "from its first moment on";
  }
}

TEST(RateWalk, EndsWhereThePlanRestsAndKnowsNothingBehindTheQueue) {
  std::vector<MotionBlock> two(2, joint_block({{1, 50}}));
  two[0] = joint_block({{0.002, 1}}, true);
  RateRoad rests(two);
  RateWalk walk = rests.walk(1, 0);
  RateStep steps[RatePlan::kStepsMax];
  int count = 0;
  EXPECT_TRUE(walk.run(0, 1, steps, count));
  EXPECT_TRUE(walk.ended());
  EXPECT_NEAR(walk.passed_s(), 0.002, 1e-12);
  RateRoad open(joint_block({{0.002, 1}}));
  walk = open.walk(1, 0);
  count = 0;
  EXPECT_FALSE(walk.run(0, 1, steps, count)) << "nothing is known behind the last block";
  EXPECT_FALSE(walk.ended());
}

TEST(RateWalk, RunTakesTheWholeTimeInStepsThatAddUp) {
  RateRoad road(joint_block({{0.01, 50}, {1, 50}}));
  RateWalk walk = road.walk(1, 0);
  RateStep steps[RatePlan::kStepsMax];
  int count = 0;
  ASSERT_TRUE(walk.run(-50, 0.03, steps, count));
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(steps[i].u, -50);
    sum += steps[i].duration_s;
  }
  EXPECT_NEAR(sum, 0.03, 1e-11);
  EXPECT_NEAR(walk.slope(), -1.5, 1e-9);
}

TEST(RateWalk, SkipAndCoastComeToTheSamePlaceAsSteps) {
  RateRoad road(joint_block({{0.004, 50, 200, 0}, {0.004, 50.8, 200, 0}, {1, 51.6}}));
  RateWalk stepped = road.walk(1, 0), coasted = stepped, skipped = stepped;
  RateStep steps[RatePlan::kStepsMax];
  int count = 0;
  ASSERT_TRUE(stepped.run(-20, 0.009, steps, count));
  coasted.coast(0.009, -20);
  EXPECT_NEAR(coasted.passed_s(), stepped.passed_s(), 1e-12);
  EXPECT_NEAR(coasted.rate(), stepped.rate(), 1e-12);
  EXPECT_NEAR(coasted.bounds().u_max, stepped.bounds().u_max, 1e-6 * stepped.bounds().u_max);
  skipped.skip(0.006);
  EXPECT_EQ(skipped.rate(), 1);
  EXPECT_NEAR(skipped.passed_s(), 0.006, 1e-15);
  EXPECT_NEAR(skipped.bounds().slope_max, (0.999 * kAccel - 200) / 51.2, 0.1) << "in the second segment";
}

// As on a path of half a millimetre a move: the place may lie hundreds of segments ahead. Farther than it
// looks nothing is known there, and no step goes on from there.
TEST(RateWalk, ASkipOverManySegmentsComesToItsPlaceOrToNone) {
  std::vector<JointSegment> segments(MotionBlock::kMaxSegments, {1e-4, 50});
  for (const int blocks : {40, 63, 100}) {
    RateRoad road(std::vector<MotionBlock>(static_cast<std::size_t>(blocks), joint_block(segments)));
    for (const double skip_s : {0.0251, 0.0307, 0.0493, 0.0675}) {
      RateWalk walk = road.walk(1, 0);
      walk.skip(skip_s);
      EXPECT_FALSE(walk.ended());
      EXPECT_NEAR(walk.passed_s(), skip_s, 1e-12);
      const int segment = static_cast<int>(skip_s / 1e-4);
      const bool known = segment < blocks * MotionBlock::kMaxSegments && segment < 512;
      EXPECT_EQ(walk.bounds().legal, known) << blocks << " blocks, " << skip_s << " s";
      EXPECT_EQ(walk.step(0, 1e-3) > 0, known);
      if (!known) continue;
      EXPECT_EQ(static_cast<int>(walk.place().block) * MotionBlock::kMaxSegments + walk.place().segment,
                segment + 1)
          << "a step ends with its segment";
    }
  }
}

}  // namespace
}  // namespace trn
