#include "interp/plan/speed/speed_problem.h"

#include <gtest/gtest.h>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/path_sampler.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

using speed::SpeedProblem;

const speed::JointRates kRates = speed::joint_rates(linear_joints(3), 1, 1);

/// Joint X moves, Y rests, Z moves with a peak of q''' inside the third interval.
speed::PathSample sample(double s) {
  speed::PathSample p;
  p.b_max = 100 + s;
  p.d1[0] = 1 + s;
  p.d2[0] = 2 - s;
  p.d3[0] = 3 * s;
  p.d1[2] = 0.5;
  p.d3[2] = s > 0.7 && s < 0.9 ? 40 : -s;
  return p;
}

struct ProblemCase {
  std::deque<speed::GridInterval> grid = make_grid({0.2, 0.4, 0.5, 0.3, 0.6}, sample);
  std::deque<speed::Headroom> headroom = std::deque<speed::Headroom>(5);
  speed::PlanEnd start, end;
  SpeedProblem problem;

  ProblemCase() {
    start.rest_length = 0.4;
    end.rest_length = 0.7;
    start.b_max = end.b_max = 1e9;
  }
  void build(const std::vector<bool>& changed = {}) {
    speed::build_problem(grid, 0, 5, kRates, headroom, start, end, changed, problem);
  }
};

// b is a quadratic spline with c in the middle of its control polygon: at nodes, values and slopes of both
// sides agree.
TEST(SpeedProblem, NodesHaveValueAndSlopeOfBothIntervals) {
  ProblemCase s;
  s.build();
  const Doubles c{4, 9, 7, 12, 5};
  for (size_t k = 1; k < 5; ++k) {
    const auto at = s.problem.at_node(c, k);
    EXPECT_NEAR(at.a, (c[k] - at.b) / s.grid[k].h, 1e-12) << "half of b' of the interval behind";
    EXPECT_NEAR(at.a, (at.b - c[k - 1]) / s.grid[k - 1].h, 1e-12) << "and before";
  }
  const auto first = s.problem.at_node(c, 0), last = s.problem.at_node(c, 5);
  EXPECT_NEAR(first.a, 2.0 / 3 * first.b / 0.4, 1e-12) << "constant jerk from rest";
  EXPECT_NEAR(first.a, (c[0] - first.b) / 0.2, 1e-12);
  EXPECT_NEAR(last.a, -2.0 / 3 * last.b / 0.7, 1e-12) << "and to rest";
  EXPECT_NEAR(last.a, (last.b - c[4]) / 0.6, 1e-12);
}

TEST(SpeedProblem, AMovingStartReproducesItsState) {
  ProblemCase s;
  s.start.at_rest = false;
  s.start.state = {16, -3};
  s.build();
  EXPECT_TRUE(s.problem.first_fixed);
  EXPECT_NEAR(s.problem.first_c, 16 - 3 * 0.2, 1e-12);
  Doubles c(5, 9.0);
  c[0] = s.problem.first_c;
  EXPECT_NEAR(s.problem.at_node(c, 0).b, 16, 1e-12);
  EXPECT_NEAR(s.problem.at_node(c, 0).a, -3, 1e-12);
}

TEST(SpeedProblem, RowsAreDerivativesOverTheLimitAndItsHeadroom) {
  ProblemCase s;
  s.headroom[1] = {0.9, 0.8, 0.7, 1.2};
  s.build();
  ASSERT_EQ(s.problem.moving, (std::vector<size_t>{0, 2})) << "Y rests";
  const auto& node2 = s.problem.acceleration[0];  // joint X, nodes 0 to 3
  EXPECT_NEAR(node2.d1[1], 1.2 / 5000 / 0.8, 1e-9) << "the lesser headroom of both intervals";
  EXPECT_NEAR(node2.d2[2], (2 - 0.6) / 5000 / 0.8, 1e-9);
  EXPECT_NEAR(node2.d2[3], (2 - 1.1) / 5000, 1e-9);
  const auto& left = s.problem.jerk[0];
  EXPECT_NEAR(left.d1[1], 1.2 / 1e5 / 0.7, 1e-11);
  EXPECT_NEAR(left.d2[1], 1.8 / 1e5 / 0.7, 1e-11);
  EXPECT_NEAR(left.d3[2], 3 * 0.6 / 1e5, 1e-9);
  EXPECT_NEAR(s.problem.jerk[2].d3[2], 3 * 1.1 / 1e5, 1e-9);
  EXPECT_NEAR(s.problem.c_max[1], 0.9 * (100 + 0.2), 1e-12);
  EXPECT_EQ(s.problem.dip[1], 1.2);
}

// Z's peak lies inside interval 2, at neither end: one end's row has it.
TEST(SpeedProblem, APeakOfTheThirdDerivativeInsideCounts) {
  ProblemCase s;
  s.build();
  EXPECT_NEAR(std::max(s.problem.jerk[1].d3[2], s.problem.jerk[3].d3[2]), 40 / 1e5, 1e-9);
  EXPECT_NEAR(std::min(s.problem.jerk[1].d3[2], s.problem.jerk[3].d3[2]), -1.1 / 1e5, 1e-9);
}

// Set up again where the headroom changed is the same as set up anew.
TEST(SpeedProblem, AChangeOfHeadroomNeedsOnlyItsOwnRows) {
  ProblemCase changed, anew;
  changed.build();
  changed.headroom[2] = anew.headroom[2] = {0.5, 0.6, 0.7, 0.9};
  changed.build({false, false, true, false, false});
  anew.build();
  EXPECT_EQ(changed.problem.c_max, anew.problem.c_max);
  EXPECT_EQ(changed.problem.dip, anew.problem.dip);
  for (size_t i = 0; i < anew.problem.jerk.size(); ++i)
    for (size_t lane = 0; lane < kLanes; ++lane)
      EXPECT_EQ(changed.problem.jerk[i].d3[lane], anew.problem.jerk[i].d3[lane]);
  for (size_t i = 0; i < anew.problem.acceleration.size(); ++i)
    for (size_t lane = 0; lane < kLanes; ++lane)
      EXPECT_EQ(changed.problem.acceleration[i].d1[lane], anew.problem.acceleration[i].d1[lane]);
}

}  // namespace
}  // namespace trn::speed_test
