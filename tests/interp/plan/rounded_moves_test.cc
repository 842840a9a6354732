#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/motion.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_planner.h"
#include "tests/interp/plan/speed_support.h"

// Steps between sharp corners, so short that neighbouring blends meet. Rounded to the four decimals of a
// program they leave lines of some ten nanometres between blends; that must not cost time. (The steps
// themselves turn by up to 0.3 degrees.)
namespace trn::speed_test {
namespace {

std::vector<Words> staircase(unsigned seed, bool rounded) {
  std::mt19937_64 rng(seed);
  const double steps[] = {0.02, 0.05, 0.3, 1};
  const double turns[] = {0, 0.5 * kPi, 0.25 * kPi, -0.25 * kPi};
  std::vector<Words> out{Words::Zero()};
  for (int i = 0; i < 150; ++i) {
    const double step = steps[rng() % 4], turn = turns[rng() % 4];
    Words next = out.back();
    next[kX] += step * std::cos(turn);
    next[kY] += step * std::sin(turn);
    out.push_back(next);
  }
  if (rounded)
    for (Words& y : out)
      for (int i = 0; i < 2; ++i) y[i] = std::round(y[i] * 1e4) / 1e4;
  return out;
}

double drive(const std::vector<Words>& points) {
  const IdentityMap map({kX, kY});
  Collector out;
  const Joints joints = linear_joints(2);
  SpeedPlanner speed(joints, map, full_shares(), out);
  GeometryPlanner geometry({}, speed);
  for (size_t i = 1; i < points.size(); ++i) {
    ProgramMove m;
    m.kind = ProgramMove::Kind::kFeed;
    m.from = points[i - 1];
    m.to = points[i];
    m.feed.tip_mm_s = 150;
    m.tolerance_mm = 0.01;
    m.source.line = static_cast<std::uint32_t>(i);
    geometry.move(m);
  }
  geometry.finish();
  speed.finish();
  double time_s = 0;
  for (const MotionBlock& b : out.blocks)
    for (int i = 0; i < b.segment_count; ++i) time_s += b.segments[static_cast<size_t>(i)].duration_s;
  return time_s;
}

TEST(RoundedMoves, CostNoTime) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const double exact = drive(staircase(seed, false)), rounded = drive(staircase(seed, true));
    std::printf("seed %u: %.3f s, rounded %.3f s\n", seed, exact, rounded);
    EXPECT_LT(rounded, 1.02 * exact) << "seed " << seed;
  }
}

}  // namespace
}  // namespace trn::speed_test
