#include "interp/plan/speed/joint_motion.h"

#include <gtest/gtest.h>

#include "core/motion.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/speed/time_law.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

/// q' = 1 + s^2: the third derivative of q by time has a peak inside.
speed::PathSample curve(double s) {
  speed::PathSample p;
  p.d1[0] = 1 + s * s;
  p.d2[0] = 2 * s;
  p.d3[0] = 2;
  return p;
}

// Ends in closed form; the range of the jerk holds that of 1000 moments, and hardly more.
TEST(JointMotion, EndsAndRangeAreThoseOfTheMotion) {
  const auto grid = make_grid({0.5, 0.5}, curve, 1e5, 8);
  const speed::JointRates rates = speed::joint_rates(linear_joints(1), 1, 1);
  speed::LawSegment segment{{0, 8, 20}, 0, 0.1, 0, 2};
  segment.jerk = (1 - 0.8 - 0.1) * 6 / 0.001;
  for (const auto& [from, to] : {std::pair(0.0, 0.1), std::pair(0.02, 0.07)}) {
    const JointMotion m = speed::joint_motion(segment, grid, rates, from, to);
    double low = 1e30, high = -1e30;
    const auto moment = [&](double t) {
      const auto at = segment.at(t);
      const speed::PathSample p = curve(at.s);
      const double a = p.d1[0] * at.a + p.d2[0] * at.v * at.v;
      const double j = p.d1[0] * segment.jerk + 3 * p.d2[0] * at.v * at.a + p.d3[0] * at.v * at.v * at.v;
      return std::array{p.d1[0] * at.v / 1e5, a / 1e5, j / 1e5};
    };
    for (int i = 0; i <= 1000; ++i) {
      const double j = moment(from + (to - from) * i / 1000)[2];
      low = std::min(low, j);
      high = std::max(high, j);
    }
    EXPECT_NEAR(m.v[0], moment(from)[0], 1e-9);
    EXPECT_NEAR(m.a[0], moment(from)[1], 1e-8);
    EXPECT_NEAR(m.a_end[0], moment(to)[1], 1e-8);
    EXPECT_LE(m.j_min[0], low + 1e-7);
    EXPECT_GE(m.j_max[0], high - 1e-7);
    EXPECT_NEAR(m.j_min[0], low, 0.02 * (high - low));
    EXPECT_NEAR(m.j_max[0], high, 0.02 * (high - low));
  }
}

// Where a bend begins, a part that begins or ends there knows its own side only.
TEST(JointMotion, APartThatBeginsAtABorderHasTheDerivativesBehindIt) {
  auto grid = make_grid(
      {0.5, 0.5}, [](double) { return straight_sample(1e6); }, 1e5, 8);
  for (speed::PathSample& p : grid[1].samples) p.d2[0] = 0.4;
  const speed::JointRates rates = speed::joint_rates(linear_joints(1), 1, 1);
  const speed::LawSegment segment{{0, 5, 0}, 0, 0.2, 0, 2};  // 5 mm/s: the border is met at 0.1 s
  const JointMotion before = speed::joint_motion(segment, grid, rates, 0, 0.1),
                    behind = speed::joint_motion(segment, grid, rates, 0.1, 0.2);
  EXPECT_EQ(before.a[0], 0);
  EXPECT_EQ(before.a_end[0], 0);
  EXPECT_NEAR(behind.a[0], 0.4 * 25 / 1e5, 1e-9);
  EXPECT_NEAR(behind.a_end[0], 0.4 * 25 / 1e5, 1e-9);
}

}  // namespace
}  // namespace trn::speed_test
