#include "interp/plan/speed/time_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/speed_problem.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

using speed::GridInterval;
using speed::LawSegment;
using speed::PathState;

TEST(TimeLaw, TimeAtIsTheInverseOfTheMotion) {
  for (const LawSegment& law : {LawSegment{{2, 3, -4}, 6, 1.2, 0, 1}, LawSegment{{0, 0, 0}, 5, 2, 0, 1},
                                LawSegment{{1, 40, 100}, -900, 0.1, 0, 1}})
    for (int i = 0; i <= 20; ++i) {
      const double t = law.duration_s * i / 20;
      const bool moving = i > 0 || law.from.v > 0;
      if (moving) {
        EXPECT_NEAR(law.time_at(law.at(t).s), t, 1e-7 * law.duration_s) << i;
      }
      EXPECT_NEAR(law.at(law.time_at(law.at(t).s)).s, law.at(t).s, 1e-12 * law.at(law.duration_s).s);
    }
}

// s, v and a are each other's derivatives, a's is the jerk.
TEST(TimeLaw, StatesAreDerivativesOfEachOther) {
  const LawSegment law{{2, 3, -4}, 6, 1.2, 0, 1};
  const double h = 1e-5;
  for (const double t : {0.1, 0.6, 1.1}) {
    const PathState before = law.at(t - h), here = law.at(t), after = law.at(t + h);
    EXPECT_NEAR((after.s - before.s) / (2 * h), here.v, 1e-8);
    EXPECT_NEAR((after.v - before.v) / (2 * h), here.a, 1e-8);
    EXPECT_NEAR((after.a - before.a) / (2 * h), law.jerk, 1e-8);
  }
}

TEST(TimeLaw, RestSegmentsHaveConstantJerkAndStandStillAtTheirEnd) {
  const auto grid = make_grid({0.2, 0.3, 0.1}, [](double) { return straight_sample(1e4); });
  const LawSegment start = speed::rest_start(grid, 0, 2, 36);
  EXPECT_EQ(start.from.v, 0);
  EXPECT_EQ(start.from.a, 0);
  EXPECT_NEAR(start.end().s, 0.5, 1e-14);
  EXPECT_NEAR(start.end().v, 6, 1e-12);
  EXPECT_NEAR(start.end().a, 2.0 / 3.0 * 36 / 0.5, 1e-10);
  const LawSegment stop = speed::rest_stop(grid, 1, 3, {0.2, 6, 0});
  EXPECT_NEAR(stop.end().s, 0.6, 1e-14);
  EXPECT_NEAR(stop.end().v, 0, 1e-12);
  EXPECT_NEAR(stop.end().a, 0, 1e-9);
  EXPECT_NEAR(stop.from.a, -2.0 / 3.0 * 36 / 0.4, 1e-10);
}

struct Law {
  std::deque<GridInterval> grid;
  speed::SpeedProblem problem;
  std::vector<LawSegment> segments;
  bool made = false;
};

// From 10 mm/s at the first node, along c, to a stop over the last interval's end.
Law law_of(const std::vector<double>& c, PathState from, double jerk_bound = 1e9) {
  Law law;
  law.grid = make_grid(
      std::vector<double>(c.size(), 0.1), [](double) { return straight_sample(1e4); }, jerk_bound);
  const std::deque<speed::Headroom> headroom(c.size());
  speed::PlanEnd start, end;
  start.at_rest = false;
  start.state = {from.v * from.v, from.a};
  end.rest_length = 0.4;
  end.b_max = 1e9;
  const speed::JointRates rates = speed::joint_rates(linear_joints(1), 1, 1);
  speed::build_problem(law.grid, 0, c.size(), rates, headroom, start, end, {}, law.problem);
  law.made = speed::make_time_law(law.grid, 0, law.problem, c, from, 0.4, law.segments);
  return law;
}

// Segments end exactly at the nodes and join in v and a; v stays at the solution's.
TEST(TimeLaw, SegmentsMeetAtTheNodesNearTheSolution) {
  std::vector<double> c;
  for (int k = 0; k < 40; ++k) c.push_back(100 + 30 * std::sin(0.2 * (k + 0.5)) - k);
  const double a0 = (c[1] - c[0]) / 0.2;
  const Law law = law_of(c, {0, std::sqrt(c[0] - 0.1 * a0), a0});
  ASSERT_TRUE(law.made);
  ASSERT_EQ(law.segments.size(), c.size());
  for (size_t k = 0; k < c.size(); ++k) {
    const PathState end = law.segments[k].end();
    EXPECT_NEAR(end.s, 0.1 * static_cast<double>(k + 1), 1e-12);
    if (k + 1 == c.size()) break;
    EXPECT_NEAR(end.v, law.segments[k + 1].from.v, 1e-11);
    EXPECT_NEAR(end.a, law.segments[k + 1].from.a, 1e-8);
    EXPECT_NEAR(end.v * end.v, law.problem.at_node(c, k + 1).b, 0.02) << k;
  }
  const PathState last = law.segments.back().end();
  EXPECT_NEAR(last.a, -2.0 / 3.0 * last.v * last.v / 0.4, 1e-9) << "constant jerk leads from here to rest";
}

// A start beside the solution: half of what b is off by goes with each interval, unless the jerk forbids it.
TEST(TimeLaw, ADeviationIsTakenBackAsTheJerkAllows) {
  const std::vector<double> c(30, 100.0);
  const Law free = law_of(c, {0, 10.1, 0}), bound = law_of(c, {0, 10.1, 0}, 50);
  ASSERT_TRUE(free.made && bound.made);
  const double off_first = free.segments[5].from.v - 10, off_bound = bound.segments[5].from.v - 10;
  EXPECT_LT(std::abs(off_first), 0.01);
  EXPECT_GT(off_bound, 0.05);
  for (size_t k = 0; k + 2 < c.size(); ++k) {
    const double change = bound.segments[k].end().a - bound.segments[k].from.a;
    EXPECT_LE(std::abs(change), 0.2 * 50 * bound.segments[k].duration_s * 1.05) << k;
  }
}

// Bounded jerk takes it back in one go: v does not swing to the solution's other side. (One that did so ever
// more, on intervals that are short against the time in which the jerk acts, came to a standstill in the
// middle of the path.)
TEST(TimeLaw, ADeviationIsTakenBackWithoutSwingingOver) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int round = 0; round < 300; ++round) {
    const std::vector<double> c(600, 100.0);
    const double off = 2 * u(rng), jerk = std::pow(10, 2.5 + u(rng));
    const Law law = law_of(c, {0, 10 + off, 0}, jerk);
    ASSERT_TRUE(law.made) << off << " " << jerk;
    double other_side = 0;
    for (const LawSegment& segment : law.segments)
      other_side = std::max(other_side, -(segment.from.v - 10) * (off > 0 ? 1 : -1));
    EXPECT_LT(other_side, 0.1 * std::abs(off)) << off << " " << jerk;
    const double time_needed = 2 * std::sqrt(2 * std::abs(off) / (0.2 * jerk));
    if (time_needed < 3) {
      EXPECT_NEAR(law.segments[590].from.v, 10, 0.02 * std::abs(off)) << off << " " << jerk;
    }
  }
}

TEST(TimeLaw, ADipThatConstantJerkCannotPassIsRefused) {
  std::vector<double> c(20, 100.0);
  c[9] = c[10] = 1e-3;
  EXPECT_FALSE(law_of(c, {0, 10, 0}).made);
}

}  // namespace
}  // namespace trn::speed_test
