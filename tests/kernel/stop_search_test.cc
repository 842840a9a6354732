#include "kernel/rate/stop_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/motion.h"
#include "kernel/rate/rate_walk.h"
#include "kernel/rate_plan.h"
#include "tests/kernel/rate_bench.h"

namespace trn {
namespace {

/// The time from rate 1 to a rate lower by `drop` at a steady speed v: u = -J/v, then the release with
/// `share` of J/v, and a slope of -A/v in between where it gets there.
double closed_form_s(double v, double drop, double share) {
  const double U = kJerkMax / v, W = kAccel / v;
  const double w = std::sqrt(2 * U * drop * share / (1 + share));
  if (w <= W) return w / U + w / (share * U);
  const double ramps = W * W / (2 * U) + W * W / (2 * share * U);
  return W / U + W / (share * U) + (drop - ramps) / W;
}

struct Found {
  double passed_s;
  RatePlan plan;
  int budget_left;
};

Found find(const RateWalk& from, double to, double share, int budget = 800) {
  RateRoad any(joint_block({{1, 1}}));
  static StopSearch search(any.limits.step_s_max);
  Found out{0, {}, budget};
  out.passed_s = search.find(from, to, share, out.budget_left, out.plan);
  return out;
}

/// Rate, slope and plan time at the end of a plan's steps, by their integrals alone.
struct End {
  double rate = 1, slope = 0, passed_s = 0, least = 1;
};
End integrate(const RatePlan& plan) {
  End end;
  for (int i = 0; i < plan.count; ++i) {
    const auto [t, u] = plan.steps[static_cast<std::size_t>(i)];
    end.passed_s += t * (end.rate + t * (end.slope / 2 + t * u / 6));
    end.rate += t * (end.slope + t * u / 2);
    end.slope += t * u;
    end.least = std::min(end.least, end.rate);
  }
  return end;
}

TEST(StopSearch, AStopFromASteadySpeedTakesTheClosedFormsTime) {
  for (const double v : {10.0, 40.0, 95.0})
    for (const double share : {0.6, 0.85}) {
      RateRoad road(joint_block({{5, v}}));
      const Found found = find(road.walk(1, 0), 0, share);
      ASSERT_GT(found.passed_s, 0) << v;
      EXPECT_TRUE(found.plan.stops);
      EXPECT_EQ(found.plan.end_rate, 0);
      const double exact = closed_form_s(v, 1, share);
      EXPECT_GT(found.plan.time_s(0), closed_form_s(v, 1, 1)) << v << " " << share;
      EXPECT_LT(found.plan.time_s(0), exact * 1.04) << v << " " << share;
      const End end = integrate(found.plan);
      EXPECT_NEAR(end.rate, 0, 1e-7);
      EXPECT_NEAR(end.slope, 0, 1e-5);
      EXPECT_GT(end.least, -1e-7) << "never backwards";
      EXPECT_NEAR(end.passed_s, found.passed_s, 1e-9);
    }
}

TEST(StopSearch, ALowerRateIsReachedInTheClosedFormsTime) {
  RateRoad road(joint_block({{5, 60}}));
  const Found found = find(road.walk(1, 0), 0.4, 0.6);
  ASSERT_GT(found.passed_s, 0);
  EXPECT_FALSE(found.plan.stops);
  EXPECT_NEAR(integrate(found.plan).rate, 0.4, 1e-6);
  EXPECT_NEAR(found.plan.time_s(0) / closed_form_s(60, 0.6, 0.6), 1, 0.04);
}

// At 95 mm/s the brake needs some 160 ms; the path itself rests after 10.
TEST(StopSearch, WhereThePathRestsSoonerTheMachineRests) {
  RateRoad road(joint_block({{0.01, 95}}, true));
  const Found found = find(road.walk(1, 0), 0, 0.6);
  EXPECT_NEAR(found.passed_s, 0.01, 1e-9);
  EXPECT_GT(found.plan.end_rate, 0.8);
  EXPECT_NEAR(found.plan.end_rate, integrate(found.plan).rate, 1e-12);
}

TEST(StopSearch, NothingIsFoundBehindWhatIsKnownOrWithoutSteps) {
  RateRoad known_too_little(joint_block({{0.01, 95}}));
  EXPECT_LT(find(known_too_little.walk(1, 0), 0, 0.6).passed_s, 0);
  RateRoad road(joint_block({{5, 95}}));
  EXPECT_LT(find(road.walk(1, 0), 0, 0.6, 5).passed_s, 0);
  EXPECT_LT(find(road.walk(0.3, 0), 0.5, 0.6).passed_s, 0) << "from below";
}

/// A joint that wanders with bounded v, a and j; every segment begins where the one before ends.
std::vector<JointSegment> wander(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<JointSegment> out;
  JointSegment s{0, 60 * unit(rng), 0, 0};
  while (out.size() < 48) {
    s.duration_s = 0.004 + 0.016 * std::abs(unit(rng));
    s.j = 0.98 * kJerkMax * unit(rng);
    const double t = s.duration_s, a = s.a + s.j * t, v = s.v + t * (s.a + t * s.j / 2);
    const double stop = v + a * std::abs(a) / (2 * kJerkMax);  // where a comes back to 0
    if (std::abs(a) > 0.98 * kAccel || std::abs(stop) > 90 || std::abs(v) > 90) {
      s.j = s.a == 0 ? 0 : -std::copysign(0.97 * kJerkMax, s.a);
      s.duration_s = s.a == 0 ? 0.004 : std::abs(s.a) / (0.97 * kJerkMax);
    }
    out.push_back(s);
    const double d = s.duration_s;
    s.v += d * (s.a + d * s.j / 2);
    s.a += d * s.j;
  }
  return out;
}

/// The worst ratio to a limit, at a thousand places of a plan: r v, r^2 a + w v and r^3 j + 3 r w a + u v.
double worst_ratio(const RatePlan& plan, const std::vector<JointSegment>& road) {
  double r = 1, w = 0, passed = 0, worst = 0;
  std::size_t k = 0;
  for (int i = 0; i < plan.count; ++i) {
    const auto [time_s, u] = plan.steps[static_cast<std::size_t>(i)];
    for (int part = 0; part < 10; ++part) {
      const double t = time_s / 10;
      // A step ends where a segment does: from there on the next one's jerk counts.
      for (; passed > road[k].duration_s - 1e-9 && k + 1 < road.size(); ++k) passed -= road[k].duration_s;
      const JointSegment& s = road[k];
      const double a = s.a + passed * s.j, v = s.v + passed * (s.a + passed * s.j / 2);
      worst = std::max({worst, std::abs(r * v) / kSpeed, std::abs(r * r * a + w * v) / kAccel,
                        std::abs(r * r * r * s.j + 3 * r * w * a + u * v) / kJerkMax});
      passed += t * (r + t * (w / 2 + t * u / 6));
      r += t * (w + t * u / 2);
      w += t * u;
    }
  }
  return worst;
}

// Where the joint turns round or gathers speed ahead, the hardest brake would find no room for its release.
TEST(StopSearch, SeededMotionsStopWithinTheLimitsAndSomeHaveToReleaseSooner) {
  int found_count = 0, backtracked = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    std::mt19937_64 rng(seed);
    const std::vector<JointSegment> segments = wander(rng);
    std::vector<MotionBlock> blocks;
    for (std::size_t i = 0; i < segments.size(); i += MotionBlock::kMaxSegments)
      blocks.push_back(joint_block({segments.begin() + static_cast<std::ptrdiff_t>(i),
                                    segments.begin() + static_cast<std::ptrdiff_t>(i) + 8}));
    RateRoad road(blocks);
    const Found found = find(road.walk(1, 0), 0, 0.6);
    if (found.passed_s < 0) continue;
    ++found_count;
    backtracked += 800 - found.budget_left > found.plan.count + 1;
    EXPECT_LE(worst_ratio(found.plan, segments), 1) << "seed " << seed;
    EXPECT_NEAR(integrate(found.plan).rate, 0, 1e-6) << "seed " << seed;
    EXPECT_GT(integrate(found.plan).least, -1e-6) << "seed " << seed;
  }
  EXPECT_GT(found_count, 240);
  EXPECT_GT(backtracked, 10);
}

TEST(StopSearch, AppendsBehindTheStepsThatThereAre) {
  RateRoad road(joint_block({{5, 40}}));
  RateWalk walk = road.walk(1, 0);
  Found found{0, {}, 800};
  ASSERT_TRUE(walk.run(-100, 0.002, found.plan.steps.data(), found.plan.count));
  const int before = found.plan.count;
  RateRoad any(joint_block({{1, 1}}));
  StopSearch search(any.limits.step_s_max);
  ASSERT_GT(search.find(walk, 0, 0.6, found.budget_left, found.plan), 0);
  EXPECT_GT(found.plan.count, before);
  EXPECT_EQ(found.plan.steps[0].u, -100);
  EXPECT_NEAR(integrate(found.plan).rate, 0, 1e-7);
}

}  // namespace
}  // namespace trn
