#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "core/axes.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/plan/speed/speed_options.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

// A corpus of seeded random paths: three and five axes, tiny and long moves, sharp and gentle, slow and fast,
// on quick and slow machines. The planner must find a plan for every window: no stop inside a stretch.
namespace trn::speed_test {
namespace {

/// One path of the corpus and the machine that drives it.
struct Sample {
  std::vector<PathPiece> pieces;
  Joints joints;
  bool trunnion = false;
  double feed = 0;
};

double log_uniform(std::mt19937_64& rng, double low, double high) {
  return low * std::pow(high / low, std::uniform_real_distribution<double>(0, 1)(rng));
}

Sample make_sample(unsigned seed) {
  std::mt19937_64 rng(seed);
  Sample s;
  const bool five = seed % 2 == 1;
  const double step_mm = log_uniform(rng, 0.02, 40), turn_rad = five ? log_uniform(rng, 1e-4, 0.15) : 0;
  const double reach = step_mm * log_uniform(rng, 0.02, 0.45);
  s.feed = log_uniform(rng, 2, 1000);
  const int count =
      static_cast<int>(std::clamp(200 / std::sqrt(step_mm), 20.0, 300.0) * log_uniform(rng, 0.1, 1));
  s.pieces = blended(random_vertices(rng, count, step_mm, turn_rad), reach);
  s.trunnion = five && seed % 3 != 0;
  s.joints = five ? cradle_joints() : linear_joints(3);
  const double slow = log_uniform(rng, 0.3, 2), stiff = log_uniform(rng, 0.3, 3);
  for (Joint& joint : s.joints) {
    joint.limit.acceleration *= slow;
    joint.limit.jerk *= slow * stiff;
    joint.limit.min -= 2000;
    joint.limit.max += 2000;
  }
  return s;
}

const JointMap& map_of(const Sample& s) {
  static const IdentityMap three({kX, kY, kZ}), five({kX, kY, kZ, kA, kC});
  static const TrunnionMap trunnion;
  if (s.trunnion) return trunnion;
  return s.joints.size() == 5 ? five : three;
}

TEST(SpeedCorpus, NoStopForWantOfAPlan) {
  const auto count = static_cast<unsigned>(test::rounds(60));
  const char* from = std::getenv("TRN_SEED");
  const unsigned first = from ? static_cast<unsigned>(std::atoi(from)) : 0;
  std::uint64_t windows = 0, slowed = 0;
  for (unsigned seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE(seed);
    const Sample s = make_sample(seed);
    const JointMap& map = map_of(s);
    const Planned r = run(s.pieces, s.joints, map, s.feed, full_shares());
    windows += r.stats.windows;
    slowed += r.stats.slowed;
    EXPECT_EQ(r.stats.fallbacks, 0u);
    if (seed % 4 != 0) continue;
    const Verdict v = judge(r.blocks, map, s.joints, 1e-4, s.feed);
    EXPECT_LE(v.velocity, 1.000001);
    EXPECT_LE(v.acceleration, 1.000001);
    EXPECT_LE(v.jerk, 1.000001);
    EXPECT_LE(v.feed, 1.000001);
    EXPECT_LE(v.join, 1e-8);
    EXPECT_TRUE(v.ends_well);
  }
  std::printf("%u paths, %llu windows, %llu of them slowed as a whole\n", count,
              static_cast<unsigned long long>(windows), static_cast<unsigned long long>(slowed));
  EXPECT_EQ(slowed, 0u);
}

// With one round of solving many windows have no plan. What is driven instead, slower or as one S-curve from
// rest to rest, keeps every limit all the same.
TEST(SpeedCorpus, TheLastResortKeepsEveryLimit) {
  SpeedOptions options = full_shares();
  options.rounds_max = 1;
  std::uint64_t slowed = 0, fallbacks = 0;
  std::vector<unsigned> seeds = {224, 336};  // which have to be slowed down more than once
  for (unsigned seed = 0; seed < 22; ++seed) seeds.push_back(seed);
  for (const unsigned seed : seeds) {
    SCOPED_TRACE(seed);
    const Sample s = make_sample(seed);
    const Planned r = run(s.pieces, s.joints, map_of(s), s.feed, options);
    slowed += r.stats.slowed;
    fallbacks += r.stats.fallbacks;
    const Verdict v = judge(r.blocks, map_of(s), s.joints, 2e-4, s.feed);
    EXPECT_LE(v.velocity, 1.000001);
    EXPECT_LE(v.acceleration, 1.000001);
    EXPECT_LE(v.jerk, 1.000001);
    if (r.stats.fallbacks > 0) continue;  // the judge knows no stop inside of a piece
    EXPECT_LE(v.join, 1e-8);
    EXPECT_TRUE(v.ends_well);
  }
  std::printf("%llu windows slowed, %llu stops\n", static_cast<unsigned long long>(slowed),
              static_cast<unsigned long long>(fallbacks));
  EXPECT_GT(slowed, 10u);
  EXPECT_GT(fallbacks, 5u);
}

}  // namespace
}  // namespace trn::speed_test
