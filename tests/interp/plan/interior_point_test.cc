#include "interp/plan/speed/interior_point.h"

#include <gtest/gtest.h>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/speed/speed_problem.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

using speed::InteriorPoint;
using speed::SpeedProblem;

/// One joint on a curve, from rest to rest over intervals of 0.5.
struct Stretch {
  SpeedProblem problem;
  Doubles start;

  explicit Stretch(size_t n, double b_max, const SampleFunction& at) {
    const auto grid = make_grid(std::vector<double>(n, 0.5), at);
    speed::PlanEnd start_end, stop_end;
    start_end.rest_length = stop_end.rest_length = 0.5;
    start_end.b_max = stop_end.b_max = b_max;
    const std::deque<speed::Headroom> headroom(n);
    speed::build_problem(grid, 0, n, speed::joint_rates(linear_joints(1), 1, 1), headroom, start_end,
                         stop_end, {}, problem);
    for (size_t k = 0; k < n; ++k) {  // half of what constant jerk and acceleration reach from the nearer end
      const double d = 0.5 * (static_cast<double>(std::min(k, n - 1 - k)) + 1), jerk = 1.5 * 4e4 * d * d;
      start.push_back(0.5 * std::min({std::cbrt(jerk * jerk), 2500 * d, 1e4}));
    }
  }
};

/// The worst violation of any row by c, written out from P5, P9, P4 and P13, as a share of the row's room.
double violation(const SpeedProblem& p, const Doubles& c) {
  double worst = -1;
  for (size_t k = 0; k <= p.intervals; ++k) {
    const auto at = p.at_node(c, k);
    const auto& d = p.acceleration[k / kLanes];
    worst = std::max(worst, std::abs(d.d1[k % kLanes] * at.a + d.d2[k % kLanes] * at.b) - 1);
  }
  for (size_t k = 0; k < p.intervals; ++k) {
    const auto left = p.at_node(c, k), right = p.at_node(c, k + 1);
    // Constant jerk: h over the time in which the acceleration runs linearly from end to end.
    const double v0 = std::sqrt(left.b),
                 mean = (v0 + std::sqrt(left.b + 2 * p.h[k] / 3 * (2 * left.a + right.a))) / 2;
    for (const size_t end : {0, 1}) {
      const auto& d = p.jerk[2 * (k / kLanes) + end];
      const auto& at = end == 0 ? left : right;
      const size_t lane = k % kLanes;
      const double v = std::sqrt(at.b);
      const double jerk =
          d.d1[lane] * (right.a - left.a) / p.h[k] * mean + 3 * d.d2[lane] * at.a * v + d.d3[lane] * at.b * v;
      worst = std::max(worst, std::abs(jerk) - 1);
    }
    worst = std::max(worst, c[k] / p.c_max[k] - 1);
    worst = std::max(worst, (left.b - p.dip[k] * (c[k] + right.b)) / c[k]);
    worst = std::max(worst, (right.b - p.dip[k] * (c[k] + left.b)) / c[k]);
  }
  return worst;
}

double time_of(const SpeedProblem& p, const Doubles& c) {
  double sum = 0;
  for (size_t k = 0; k < p.intervals; ++k) sum += p.h[k] / std::sqrt(c[k]);
  return sum;
}

/// A joint whose derivatives wave.
speed::PathSample wave(double s) {
  speed::PathSample p = straight_sample(200.0 * 200);
  p.d1[0] = 1 + 0.3 * std::sin(s);
  p.d2[0] = 0.3 * std::cos(s);
  p.d3[0] = -0.3 * std::sin(s);
  return p;
}

const speed::InteriorPointOptions kFine{200, 5e-4, 0.01};

// Without joints that bind, every coefficient comes to its bound of speed.
TEST(InteriorPoint, SpeedBoundsAloneAreReached) {
  const Stretch stretch(20, 1e9, [](double s) {
    speed::PathSample p = straight_sample(s < 5 ? 4 : 9);
    p.d1[0] = 1e-6;
    return p;
  });
  Doubles c = stretch.start;
  const auto result = InteriorPoint().solve(stretch.problem, kFine, c);
  ASSERT_TRUE(result.feasible);
  EXPECT_NEAR(result.time_s, time_of(stretch.problem, stretch.problem.c_max), 2e-3 * result.time_s);
  EXPECT_NEAR(result.time_s, time_of(stretch.problem, c), 1e-9);
}

// Time falls with every coefficient, so at the optimum none of them alone can grow; and all rows hold.
TEST(InteriorPoint, AtTheOptimumNoCoefficientCanGrow) {
  const Stretch stretch(40, 1e4, wave);
  Doubles c = stretch.start;
  const auto result = InteriorPoint().solve(stretch.problem, kFine, c);
  ASSERT_TRUE(result.feasible);
  EXPECT_LT(violation(stretch.problem, c), 1e-3);
  for (size_t k = 0; k < c.size(); ++k) {
    Doubles more = c;
    more[k] *= 1.1;
    EXPECT_GT(violation(stretch.problem, more), 1e-3) << k;
  }
}

// Nor do random directions that keep the rows lead to a shorter time: P7 is convex, the rows nearly so.
TEST(InteriorPoint, NoFeasibleNeighbourIsFaster) {
  const Stretch stretch(24, 1e4, wave);
  Doubles c = stretch.start;
  const auto result = InteriorPoint().solve(stretch.problem, kFine, c);
  ASSERT_TRUE(result.feasible);
  std::mt19937_64 rng(9);
  std::normal_distribution<double> g;
  int feasible = 0;
  for (int i = 0; i < 20000; ++i) {
    Doubles near = c;
    const double size = std::pow(10, -1 - 3.0 * (i % 10) / 10);
    const size_t centre = static_cast<size_t>(i) % c.size();
    for (size_t k = 0; k < c.size(); ++k) {
      const double d = (static_cast<double>(k) - static_cast<double>(centre)) / (1 + i % 7);
      near[k] *= 1 + size * (g(rng) * 0.2 + (i % 2 ? 1 : -1)) * std::exp(-d * d);
    }
    if (violation(stretch.problem, near) > 1e-3) continue;
    ++feasible;
    EXPECT_GT(time_of(stretch.problem, near), 0.998 * result.time_s);
  }
  EXPECT_GT(feasible, 20);
}

// Resuming with rows a little tighter comes to the same as starting anew, in fewer steps.
TEST(InteriorPoint, ResumingFindsTheSameOptimumSooner) {
  Stretch stretch(40, 1e4, wave);
  Doubles c = stretch.start, again;
  InteriorPoint solver;
  solver.solve(stretch.problem, {60, 5e-3, 0.01}, c);
  for (double& bound : stretch.problem.c_max) bound *= 0.99;
  again = stretch.start;
  const auto resumed = solver.resume(stretch.problem, {60, 5e-3, 3e-4}, c);
  const auto anew = InteriorPoint().solve(stretch.problem, {60, 5e-3, 0.01}, again);
  ASSERT_TRUE(resumed.feasible && anew.feasible);
  EXPECT_NEAR(resumed.time_s, anew.time_s, 6e-3 * anew.time_s);
  EXPECT_LT(resumed.iterations, anew.iterations);
}

// A moving start is no choice: its coefficient stays.
TEST(InteriorPoint, AGivenFirstCoefficientStays) {
  Stretch stretch(20, 1e4, wave);
  stretch.problem.first_fixed = true;
  stretch.problem.first_c = 250;
  stretch.problem.node_b1[0] = 1;
  stretch.problem.node_a1[0] = 0;
  stretch.problem.c_max[0] = 500;
  Doubles c = stretch.start;
  ASSERT_TRUE(InteriorPoint().solve(stretch.problem, kFine, c).feasible);
  EXPECT_EQ(c[0], 250);
  EXPECT_GT(c[5], 250);
}

}  // namespace
}  // namespace trn::speed_test
