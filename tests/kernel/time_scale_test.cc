#include "kernel/time_scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace trn {
namespace {

constexpr double kT = 1e-3;

Joints cradle_like() {
  Joints joints(3);
  joints[0].limit = {-400, 400, 500, 5000, 100000};
  joints[1].limit = {-2, 2, 2.1, 14, 280};
  joints[2].limit = {-600, 600, 4.2, 26, 520};
  return joints;
}

// The two inequalities that protect every plan inside the shares, on the rate's own samples: r' and r'' of
// the piecewise law are recovered from the plan time that passes in each step.
void expect_within_bounds(const Joints& joints, PlanShares shares, const std::vector<double>& plan_time) {
  double k_a = 0, k_aj = 0, k_j = 0;
  for (const Joint& j : joints) {
    k_a = std::max(k_a, j.limit.velocity / j.limit.acceleration);
    k_aj = std::max(k_aj, j.limit.acceleration / j.limit.jerk);
    k_j = std::max(k_j, j.limit.velocity / j.limit.jerk);
  }
  for (size_t i = 3; i < plan_time.size(); ++i) {
    const double r = (plan_time[i - 1] - plan_time[i - 2]) / kT;
    const double slope = (plan_time[i] - 2 * plan_time[i - 1] + plan_time[i - 2]) / kT / kT;
    const double curve =
        (plan_time[i] - 3 * plan_time[i - 1] + 3 * plan_time[i - 2] - plan_time[i - 3]) / kT / kT / kT;
    EXPECT_LE(std::abs(slope) * k_a, 1 - shares.acceleration * r * r + 1e-3 * k_a) << "step " << i;
    EXPECT_LE(3 * r * std::abs(slope) * shares.acceleration * k_aj + std::abs(curve) * k_j,
              1 - shares.jerk * r * r * r + 2e-3)
        << "step " << i << " r " << r << " slope " << slope << " curve " << curve;
  }
}

TEST(TimeScale, HoldStopsAndResumeReturnsWithinTheBounds) {
  TimeScale scale(cradle_like(), {}, kT);
  std::vector<double> t(1, 0.0);
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) t.push_back(t.back() + scale.step());
  };
  run(10);
  scale.set_target(0);
  const double before = t.back();
  int steps = 0;
  while (!scale.at_target() && steps < 3000) run(1), ++steps;
  EXPECT_EQ(scale.rate(), 0);
  EXPECT_LT(steps, 800);
  std::printf("hold takes %d periods, %.3f s of plan time\n", steps, t.back() - before);
  run(5);
  scale.set_target(1);
  steps = 0;
  while (!scale.at_target() && steps < 3000) run(1), ++steps;
  EXPECT_EQ(scale.rate(), 1);
  run(5);
  expect_within_bounds(cradle_like(), {}, t);
}

TEST(TimeScale, AnySequenceOfTargetsStaysWithinTheBounds) {
  std::mt19937_64 rng(7);
  for (int round = 0; round < 200; ++round) {
    TimeScale scale(cradle_like(), {}, kT);
    std::vector<double> t(1, 0.0);
    std::uniform_real_distribution<double> u(-0.3, 1.3);
    std::uniform_int_distribution<int> wait(1, 400);
    for (int k = 0; k < 8; ++k) {
      scale.set_target(u(rng));
      for (int i = wait(rng); i > 0; --i) {
        t.push_back(t.back() + scale.step());
        ASSERT_GE(scale.rate(), 0);
        ASSERT_LE(scale.rate(), 1);
      }
    }
    expect_within_bounds(cradle_like(), {}, t);
    if (HasFailure()) return;
  }
}

// A new rate is reached and not passed, from above as from below.
TEST(TimeScale, ATargetIsNotOvershot) {
  for (const double from : {0.0, 0.4, 1.0})
    for (const double to : {0.05, 0.3, 0.6, 0.8, 0.9, 0.95}) {
      TimeScale scale(cradle_like(), {}, kT);
      scale.set_target(from);
      for (int i = 0; i < 5000 && !scale.at_target(); ++i) scale.step();
      ASSERT_TRUE(scale.at_target());
      scale.set_target(to);
      double farthest = 0;
      for (int i = 0; i < 5000 && !scale.at_target(); ++i) {
        scale.step();
        farthest = std::max(farthest, (scale.rate() - to) * (to > from ? 1 : -1));
      }
      EXPECT_TRUE(scale.at_target()) << from << " to " << to;
      EXPECT_LT(farthest, 1e-4) << from << " to " << to;
    }
}

// From full rate at the longest: a rate that still rises has first to be brought to its peak.
TEST(TimeScale, AStopFromAnyStateTakesLittleMorePlanTimeThanFromFullRate) {
  const auto stop = [](TimeScale& scale) {
    scale.set_target(0);
    double passed = 0;
    for (int steps = 0; !scale.at_target() && steps < 5000; ++steps) passed += scale.step();
    EXPECT_TRUE(scale.at_target());
    return passed;
  };
  TimeScale full(cradle_like(), {}, kT);
  const double longest = stop(full);
  double worst = 0;
  std::mt19937_64 rng(8);
  std::uniform_real_distribution<double> u(0, 1);
  std::uniform_int_distribution<int> wait(1, 300);
  for (int round = 0; round < 500; ++round) {
    TimeScale scale(cradle_like(), {}, kT);
    for (int k = 0; k < 4; ++k) {
      scale.set_target(u(rng) < 0.3 ? 1 : u(rng));
      for (int i = wait(rng); i > 0; --i) scale.step();
    }
    worst = std::max(worst, stop(scale));
  }
  std::printf("stop from full rate %.4f s of plan time, from the worst state %.4f s\n", longest, worst);
  EXPECT_LE(worst, 1.1 * longest);
}

// The least time from one rate to another, s: the two inequalities followed in the plane of rate and speed,
// from both ends, without a reserve.
double least_time_s(const Joints& joints, PlanShares shares, double from, double to) {
  constexpr int kParts = 4000;
  double k_a = 0, k_aj = 0, k_j = 0;
  for (const Joint& j : joints) {
    k_a = std::max(k_a, j.limit.velocity / j.limit.acceleration);
    k_aj = std::max(k_aj, j.limit.acceleration / j.limit.jerk);
    k_j = std::max(k_j, j.limit.velocity / j.limit.jerk);
  }
  const double h = std::abs(to - from) / kParts;
  const auto rate = [&](int i) { return from + (to - from) * i / kParts; };
  const auto most = [&](int i) {
    const double r = rate(i), spare = 1 - shares.jerk * r * r * r;
    const double by_speed = (1 - shares.acceleration * r * r) / k_a;
    return r > 0 ? std::min(by_speed, spare / (3 * r * shares.acceleration * k_aj)) : by_speed;
  };
  const auto next = [&](int i, int neighbour, double w) {
    const double r = rate(i), spare = 1 - shares.jerk * r * r * r - 3 * r * w * shares.acceleration * k_aj;
    return std::min(most(neighbour), std::sqrt(w * w + 2 * h * std::max(spare, 0.0) / k_j));
  };
  std::vector<double> up(kParts + 1, 0.0), down(kParts + 1, 0.0);
  for (int i = 0; i < kParts; ++i) up[i + 1] = next(i, i + 1, up[i]);
  for (int i = kParts; i > 0; --i) down[i - 1] = next(i, i - 1, down[i]);
  double time_s = 0;
  for (int i = 0; i < kParts; ++i)
    time_s += 2 * h / (std::min(up[i], down[i]) + std::min(up[i + 1], down[i + 1]));
  return time_s;
}

// The bounds are there to be used. Near the rate 1 little jerk is left, and the reserve counts for more.
TEST(TimeScale, ARateComesToItsTargetInLittleMoreThanTheLeastTime) {
  for (const double from : {0.0, 0.3, 0.6, 1.0})
    for (const double to : {0.0, 0.1, 0.3, 0.5, 0.8}) {
      if (std::abs(to - from) < 0.1) continue;
      TimeScale scale(cradle_like(), {}, kT);
      scale.set_target(from);
      for (int i = 0; i < 5000 && !scale.at_target(); ++i) scale.step();
      scale.set_target(to);
      int steps = 0;
      for (; std::abs(scale.rate() - to) > 1e-3 && steps < 5000; ++steps) scale.step();
      const double least_s = least_time_s(cradle_like(), {}, from, to);
      EXPECT_LE(steps * kT, (to > 0.5 && from < to ? 1.6 : 1.3) * least_s) << from << " to " << to;
      EXPECT_GE(steps * kT, 0.9 * least_s) << from << " to " << to << ": no bound allows that";
    }
}

}  // namespace
}  // namespace trn
