#include "interp/plan/speed/limit_use.h"

#include <gtest/gtest.h>

#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/speed/speed_problem.h"
#include "interp/plan/speed/time_law.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

using speed::GridInterval;
using speed::LawSegment;
using speed::LimitUse;

const speed::JointRates kRates = speed::joint_rates(linear_joints(2), 1, 1);

/// Two joints whose derivatives are parabolas, so that parabolas through samples are exact.
speed::PathSample parabolas(double s) {
  speed::PathSample p;
  p.b_max = 200 + 40 * s;
  p.d1[0] = 1 - 0.2 * s + 0.1 * s * s;
  p.d2[0] = 2 + s - 3 * s * s;
  p.d3[0] = 5 - 20 * s;
  p.d1[1] = 0.4 + s;
  p.d2[1] = -4 + 6 * s;
  p.d3[1] = 30 * s * s;
  return p;
}

/// Use of one moment, by the chain rule.
void raise(LimitUse& use, const speed::PathSample& p, const speed::PathState& at, double jerk) {
  use.velocity_squared = std::max(use.velocity_squared, at.v * at.v / p.b_max);
  for (size_t j = 0; j < 2; ++j) {
    const double a = p.d1[j] * at.a + p.d2[j] * at.v * at.v;
    const double third = p.d1[j] * jerk + 3 * p.d2[j] * at.v * at.a + p.d3[j] * at.v * at.v * at.v;
    use.acceleration = std::max(use.acceleration, std::abs(a) / kRates.acceleration[j]);
    use.jerk = std::max(use.jerk, std::abs(third) / kRates.jerk[j]);
  }
}

/// The worst over a segment within an interval, at 2000 moments.
LimitUse brute_force(const LawSegment& segment, const GridInterval& g) {
  LimitUse use;
  for (const double s : {g.s, g.s + g.h})
    raise(use, parabolas(s), segment.at(segment.time_at(s)), segment.jerk);
  for (int i = 0; i <= 2000; ++i) {
    const auto at = segment.at(segment.duration_s * i / 2000);
    if (at.s >= g.s && at.s <= g.s + g.h) raise(use, parabolas(at.s), at, segment.jerk);
  }
  return use;
}

// The judged places lie a third of the samples' distance apart, so the peak may lie a little higher.
void expect_near(const LimitUse& use, const LimitUse& truth) {
  EXPECT_LE(use.velocity_squared, truth.velocity_squared * 1.0001);
  EXPECT_LE(use.acceleration, truth.acceleration * 1.0001);
  EXPECT_LE(use.jerk, truth.jerk * 1.0001);
  EXPECT_GE(use.velocity_squared, truth.velocity_squared * 0.98);
  EXPECT_GE(use.acceleration, truth.acceleration * 0.98);
  EXPECT_GE(use.jerk, truth.jerk * 0.98);
}

TEST(LimitUse, IsTheWorstOfAllMomentsInTheInterval) {
  auto grid = make_grid({1.0}, parabolas, 1e5, 4);
  for (const double a : {-30.0, 0.0, 60.0}) {
    LawSegment segment{{0, 12, a}, 0, 0.1, 0, 1};
    segment.jerk = (1 - 1.2 - a * 0.005) * 6 / 0.001;  // s = 1 after 0.1 s
    expect_near(speed::limit_use(segment, grid[0], kRates), brute_force(segment, grid[0]));
  }
}

// A segment over two intervals: each interval counts its own part; from rest, where Newton's method needs
// help.
TEST(LimitUse, EachIntervalOfARestSegmentCountsItsOwnPart) {
  auto grid = make_grid({0.3, 0.7}, parabolas, 1e5, 4);
  const LawSegment start = speed::rest_start(grid, 0, 2, 150);
  for (GridInterval& g : grid) expect_near(speed::limit_use(start, g, kRates), brute_force(start, g));
  EXPECT_LT(speed::limit_use(start, grid[0], kRates).velocity_squared,
            0.5 * speed::limit_use(start, grid[1], kRates).velocity_squared);
}

TEST(LimitUse, ASecondSegmentIsJudgedOnTheKeptRows) {
  auto grid = make_grid({1.0}, parabolas, 1e5, 4);
  const LawSegment slow = speed::rest_start(grid, 0, 1, 10), fast = speed::rest_start(grid, 0, 1, 90);
  const LimitUse one = speed::limit_use(slow, grid[0], kRates),
                 other = speed::limit_use(fast, grid[0], kRates);
  EXPECT_NEAR(other.velocity_squared, 9 * one.velocity_squared, 1e-4 * other.velocity_squared);
  EXPECT_NEAR(other.acceleration, 9 * one.acceleration, 1e-4 * other.acceleration);
  EXPECT_NEAR(other.jerk, 27 * one.jerk, 1e-4 * other.jerk);
}

// With the bound, the worst use at the samples is 1; with less headroom in one limit, b is less as that limit
// asks.
TEST(RestBound, TheWorstUseAtTheSamplesIsOne) {
  auto grid = make_grid({0.3, 0.7}, parabolas, 1e5, 4);
  for (const bool start : {true, false})
    for (const speed::Headroom room : {speed::Headroom{}, speed::Headroom{0.01, 1, 1},
                                       speed::Headroom{1, 0.1, 1}, speed::Headroom{1, 1, 0.01}}) {
      const std::deque<speed::Headroom> headroom(2, room);
      const double b = speed::rest_bound(grid, 0, 2, kRates, headroom, start);
      const LawSegment segment =
          start ? speed::rest_start(grid, 0, 2, b) : speed::rest_stop(grid, 0, 2, {0, std::sqrt(b), 0});
      LimitUse use;
      for (const GridInterval& g : grid)
        for (const speed::PathSample& p : g.samples)
          raise(use, p, segment.at(segment.time_at(p.s)), segment.jerk);
      EXPECT_NEAR(std::max({use.velocity_squared / room.velocity, use.acceleration / room.acceleration,
                            use.jerk / room.jerk}),
                  1, 1e-9);
    }
}

}  // namespace
}  // namespace trn::speed_test
