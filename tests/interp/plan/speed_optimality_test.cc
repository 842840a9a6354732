#include <gtest/gtest.h>

#include "tests/interp/plan/optimal_cases.h"
#include "tests/interp/plan/speed_support.h"

// The planner against certified optimal times of the same joint paths.
namespace trn::speed_test {
namespace {

TEST(SpeedOptimality, WithinThreePercentOfTheBestMotion) {
  for (const OptimalCase& c : optimal_cases()) {
    SCOPED_TRACE(c.name);
    const Planned r = run(c.pieces, c.joints, *c.map, c.feed, full_shares());
    std::printf("%-16s %.5f s, best %.5f s, ratio %.4f\n", c.name.c_str(), r.stats.time_s, c.best_s,
                r.stats.time_s / c.best_s);
    EXPECT_LE(r.stats.time_s, 1.03 * c.best_s);
    EXPECT_GE(r.stats.time_s, 0.995 * c.best_s);
    const Verdict v = judge(r.blocks, *c.map, c.joints, 1e-4, c.feed);
    EXPECT_LE(std::max({v.velocity, v.acceleration, v.jerk, v.feed}), 1.000001);
  }
}

}  // namespace
}  // namespace trn::speed_test
