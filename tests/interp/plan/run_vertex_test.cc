#include "interp/plan/geometry/run_vertex.h"

#include <gtest/gtest.h>

#include <random>

#include "core/axes.h"
#include "core/units.h"

namespace trn {
namespace {

TEST(RunVertex, ARunCountsADegreeAsThreeTenthsOfAMillimetre) {
  Words chord = Words::Zero();
  chord[kX] = 0.4;
  chord[kA] = kPi / 180;
  EXPECT_NEAR(run_length(chord), 0.5, 1e-12);
}

// The least weighed distance, by trying many t.
TEST(RunVertex, NearestAlongIsTheLeastWeighedDistance) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> g;
  for (int i = 0; i < 50; ++i) {
    Words deviation, slope;
    for (int k = 0; k < 6; ++k) {
      deviation[k] = g(rng);
      slope[k] = g(rng);
    }
    const double mm = 0.3, rad = 0.7;
    const auto distance = [&](double t) {
      const Words d = deviation - t * slope;
      return d.head<3>().squaredNorm() / (mm * mm) + d.tail<3>().squaredNorm() / (rad * rad);
    };
    double best = 0;
    for (int k = -40000; k <= 40000; ++k)
      if (distance(k * 1e-3) < distance(best)) best = k * 1e-3;
    EXPECT_NEAR(nearest_along(deviation, slope, mm, rad), best, 6e-4);
  }
}

TEST(RunVertex, WithoutARotaryTolerancePositionAloneDecides) {
  Words deviation = Words::Zero(), slope = Words::Zero();
  deviation[kX] = 3;
  deviation[kA] = 5;
  slope[kX] = 2;
  slope[kA] = 1;
  EXPECT_NEAR(nearest_along(deviation, slope, 0.1, 0), 1.5, 1e-15);
  EXPECT_EQ(nearest_along(deviation, Words::Zero(), 0.1, 0), 0);
}

TEST(RunVertex, UseIsDeviationOverToleranceOfEachGroupOfWords) {
  Words d = Words::Zero();
  d[kY] = 0.03;
  d[kC] = 0.002;
  const TubeUse use = tube_use(d, 0.1, 0.004);
  EXPECT_NEAR(use.linear, 0.3, 1e-15);
  EXPECT_NEAR(use.rotary, 0.5, 1e-15);
  EXPECT_EQ(use.worst(), use.rotary);
  EXPECT_EQ(tube_use(1e-13 * d, 0, 0).worst(), 0) << "rounding needs no tolerance";
  EXPECT_GE(tube_use(d, 0.1, 0).rotary, 1e6);
}

}  // namespace
}  // namespace trn
