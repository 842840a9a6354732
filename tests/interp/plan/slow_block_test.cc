#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/ports.h"
#include "interp/plan/speed/speed_planner.h"
#include "tests/interp/plan/driven_program.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

// A short way that must be driven slowly, between two fast ones, against S-curves in closed form. TRN_LONG=n:
// so many random ones.
namespace trn::speed_test {
namespace {

constexpr double kAcceleration = 5000, kJerk = 100000;  // of linear_joints

struct Ramp {
  double time_s, length;
};

// From one speed to another, both without acceleration, as fast as the limits allow.
Ramp ramp(double v0, double v1) {
  const double dv = std::abs(v1 - v0);
  const double time_s = dv >= kAcceleration * kAcceleration / kJerk
                            ? dv / kAcceleration + kAcceleration / kJerk
                            : 2 * std::sqrt(dv / kJerk);
  return {time_s, (v0 + v1) / 2 * time_s};
}

// Over a length from v0 to v1, at most v_max in between; as long as the ramp from one to the other at least.
double leg_time(double length, double v0, double v1, double v_max) {
  double low = std::max(v0, v1), high = v_max;
  const auto both = [&](double v) { return ramp(v0, v).length + ramp(v, v1).length; };
  if (both(high) <= length)
    return ramp(v0, high).time_s + ramp(high, v1).time_s + (length - both(high)) / high;
  for (int i = 0; i < 200; ++i) {
    const double mid = (low + high) / 2;
    (both(mid) > length ? high : low) = mid;
  }
  return ramp(v0, low).time_s + ramp(low, v1).time_s + (length - both(low)) / low;
}

struct Block {
  double length, v;
};

// Along X; every second block is slow.
Planned drive(const std::vector<Block>& blocks, const Joints& joints, const JointMap& map) {
  Collector out;
  SpeedPlanner planner(joints, map, full_shares(), out);
  Words at = Words::Zero();
  for (size_t i = 0; i < blocks.size(); ++i) {
    Words to = at;
    to[kX] += blocks[i].length;
    planner.piece(
        plan(make_line(at, to), blocks[i].v, i + 1 == blocks.size(), static_cast<std::uint32_t>(i + 1)));
    at = to;
  }
  planner.finish();
  return {std::move(out.blocks), planner.stats()};
}

// With the acceleration 0 where a slow block begins and ends; the optimum may be shorter by little.
double closed_form(const std::vector<Block>& blocks) {
  double time_s = 0;
  for (size_t i = 0; i < blocks.size(); ++i) {
    const double v0 = i == 0 ? 0 : std::min(blocks[i - 1].v, blocks[i].v);
    const double v1 = i + 1 == blocks.size() ? 0 : std::min(blocks[i + 1].v, blocks[i].v);
    time_s += leg_time(blocks[i].length, v0, v1, blocks[i].v);
  }
  return time_s;
}

void expect_near_optimum(const std::vector<Block>& blocks, const std::string& name) {
  const IdentityMap map({kX, kY});
  const Joints joints = linear_joints(2);
  const Planned planned = drive(blocks, joints, map);
  const Verdict verdict = judge(planned.blocks, map, joints, 2.5e-4);
  EXPECT_LT(planned.stats.time_s, 1.05 * closed_form(blocks)) << name;
  EXPECT_EQ(planned.stats.fallbacks, 0U) << name;
  EXPECT_LE(verdict.acceleration, 1) << name;
  EXPECT_LE(verdict.jerk, 1) << name;
  EXPECT_TRUE(verdict.ends_well) << name;
}

TEST(SlowBlock, CostsItsOwnTimeAndTheRamps) {
  for (const double v : {10.0, 1.0, 0.1666, 0.01, 1e-3, 1e-4})
    for (const double length : {1.0, 0.01, 1e-3, 1e-4, 1e-6}) {
      if (length / v > 20) continue;
      expect_near_optimum({{10, 100}, {length, v}, {10, 100}},
                          std::to_string(v) + " mm/s over " + std::to_string(length) + " mm");
    }
}

TEST(SlowBlock, RandomOnes) {
  for (int seed = 1; seed <= test::rounds(40); ++seed) {
    std::mt19937_64 rng(static_cast<unsigned>(seed));
    const auto power = [&](double low, double high) {
      return std::exp(std::uniform_real_distribution<double>(std::log(low), std::log(high))(rng));
    };
    const double fast = power(20, 400);
    std::vector<Block> blocks{{power(20, 80), fast}};
    for (size_t i = 0, n = 1 + rng() % 4; i < n; ++i) {
      const double v = power(3e-4, 0.02 * fast);
      blocks.push_back({v * power(1e-4, 1), v});
      blocks.push_back({power(20, 80), fast});
    }
    expect_near_optimum(blocks, "seed " + std::to_string(seed));
  }
}

}  // namespace
}  // namespace trn::speed_test
