#include "interp/plan/speed/path_grid.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/path.h"
#include "interp/plan/speed/joint_curve.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

using speed::GridInterval;

/// The grid over pieces at these feeds, as one whole stretch; `as_they_come`: laid as far as is known behind
/// each.
struct Laid {
  IdentityMap map{{kX, kY, kZ}};
  Joints joints = linear_joints(3);
  speed::PathSampler sampler{joints, map, speed::joint_rates(joints, 1, 1)};
  speed::PathGrid grid{sampler, 0.005, 0.1};

  Laid(const std::vector<PathPiece>& pieces, const std::vector<double>& feeds, bool as_they_come = false) {
    grid.begin_stretch();
    speed::JointCurve curve;
    for (size_t i = 0; i < pieces.size(); ++i) {
      const PlanPiece piece = plan(pieces[i], feeds[i % feeds.size()], i + 1 == pieces.size());
      sampler.curve(piece, curve);
      grid.add(piece, curve);
      if (as_they_come && !piece.ends_stretch) grid.lay(false, false);
    }
    grid.lay(true, false);
  }
};

PathPiece line(double from, double to) {
  Words a = Words::Zero(), b = Words::Zero();
  a[kX] = from;
  b[kX] = to;
  return make_line(a, b);
}

// Intervals follow each other from 0 to the end without gap, each with samples at both its ends.
TEST(PathGrid, CoversTheStretchWithoutGap) {
  const std::vector<PathPiece> arcs = circle(10, 1);
  Laid laid({line(0, 3), line(3, 3.0001), line(3.0001, 20)}, {100});
  double s = 0;
  for (const GridInterval& g : laid.grid.intervals()) {
    EXPECT_NEAR(g.s, s, 1e-12);
    EXPECT_GT(g.h, 0);
    EXPECT_NEAR(g.samples.front().s, g.s, 1e-9);
    EXPECT_NEAR(g.samples.back().s, g.s + g.h, 1e-9);
    s = g.s + g.h;
  }
  EXPECT_NEAR(s, 20, 1e-9);
}

// At the estimated speed no interval takes much longer than the spacing that was asked for.
TEST(PathGrid, NodesLieEvenlyInTime) {
  Laid laid({line(0, 20)}, {100});
  for (const GridInterval& g : laid.grid.intervals()) EXPECT_LT(g.time_est_s, 1.05 * 0.005) << g.s;
  EXPECT_LT(laid.grid.intervals().size(), 2 * (20 / 100.0 + 0.1) / 0.005);
}

// An interval has one jerk of the path. Over a radian of a circle the joints' jerks turn by as much, which it
// cannot follow, however long the piece.
TEST(PathGrid, AtOneFeedIntervalsGrowOnlyAsFarAsTheCurveAllows) {
  Laid laid(circle(10, 50), {100});
  for (const GridInterval& g : laid.grid.intervals()) ASSERT_LT(g.h, 10) << g.s;
}

// P8: next to a place at 0.01 mm/s no interval is longer than half of e + d.
TEST(PathGrid, IntervalsGrowWithTheDistanceFromASlowPlace) {
  Laid laid({line(0, 20), line(20, 20.002), line(20.002, 40)}, {100, 0.01, 100});
  const double v = 0.01, e = v * std::sqrt(2 * v / 1e5);
  int near = 0;
  for (const GridInterval& g : laid.grid.intervals()) {
    if (g.s < 20.002 - 1e-9 || g.s > 30) continue;
    const double d = g.s - 20.002;
    EXPECT_LE(g.h, 0.5 * (std::max(e, 1e-7) + d) * 1.01 + 1e-9) << d;
    near += d < 0.1;
  }
  EXPECT_GT(near, 15) << "some ten for each factor of 100 in the speed";
}

// The pieces come one by one. A long piece in front, which alone takes longer than what is looked ahead, must
// not get its grid before the slow place behind it is known: P8 holds on both sides of the place, wherever it
// lies.
TEST(PathGrid, ALongPieceWaitsForTheSlowPlaceBehindIt) {
  constexpr double kShortest = 5e-6;  // mm: no shorter ones are made
  for (const double length : {0.7, 2.0, 6.0, 20.0, 60.0})
    for (const double between : {0.0, 0.004, 0.05, 0.4}) {
      std::vector<PathPiece> pieces = {line(0, length)};
      std::vector<double> feeds = {100};
      double s = length;
      if (between > 0) {
        pieces.push_back(line(s, s + between));
        feeds.push_back(100);
        s += between;
      }
      pieces.push_back(line(s, s + 0.002));
      feeds.push_back(0.01);
      pieces.push_back(line(s + 0.002, s + 20));
      feeds.push_back(100);
      Laid laid(pieces, feeds, true);
      for (const GridInterval& g : laid.grid.intervals()) {
        const double d = s - (g.s + g.h);
        if (d < -1e-9 || d > length / 2) continue;
        EXPECT_LE(g.h, 0.5 * (g.h + d) * 1.01 + kShortest) << length << " " << between << " " << d;
      }
    }
}

// Between samples the joints' derivatives are predicted to a thousandth of the limit, at the estimated speed.
TEST(PathGrid, SamplesPredictWhatLiesBetween) {
  Laid laid(circle(2, 1), {400});
  const PlanPiece piece = plan(circle(2, 1)[0], 400);
  for (const GridInterval& g : laid.grid.intervals())
    for (size_t i = 0; i + 2 < g.samples.size(); i += 2) {
      const double s = (g.samples[i].s + g.samples[i + 1].s) / 2;
      const auto predicted = interpolate(&g.samples[i], s, 3),
                 truth = laid.sampler.sample(piece, {}, s, s, 0);
      for (size_t j = 0; j < 2; ++j) {
        EXPECT_LT(g.b_est * std::abs(predicted.d2[j] - truth.d2[j]), 2e-3 * 5000);
        EXPECT_LT(std::pow(g.b_est, 1.5) * std::abs(predicted.d3[j] - truth.d3[j]), 2e-3 * 1e5);
      }
    }
}

}  // namespace
}  // namespace trn::speed_test
