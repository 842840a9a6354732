#include "kernel/s_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trn {
namespace {

// Where every limit is reached: cruise, both ramps of the acceleration.
TEST(SCurve, ALongWayTakesTheClosedFormsTime) {
  const double d = 100, v = 20, a = 50, j = 400;
  const SCurve curve(d, v, a, j);
  EXPECT_NEAR(curve.duration_s(), d / v + v / a + a / j, 1e-12);
}

TEST(SCurve, AWayTooShortForTheAccelerationTakesFourEqualParts) {
  const double d = 0.01, j = 400;
  const SCurve curve(d, 20, 50, j);
  EXPECT_NEAR(curve.duration_s(), 4 * std::cbrt(d / (2 * j)), 1e-12);
}

TEST(SCurve, AWayTooShortForTheSpeedTakesTheClosedFormsTime) {
  const double d = 5, a = 50, j = 400;
  const SCurve curve(d, 1000, a, j);
  EXPECT_NEAR(curve.duration_s(), a / j + std::sqrt(a * a / (j * j) + 4 * d / a), 1e-12);
}

// Differences of the places are means of the derivatives, so no limit may be broken by them at all.
TEST(SCurve, SeededCurvesKeepTheirLimitsEndExactlyAndNeverTurnBack) {
  std::mt19937_64 rng(11);
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>(0, 1)(rng));
  };
  constexpr int kSteps = 400;
  for (int round = 0; round < 2000; ++round) {
    const double d = log_uniform(1e-4, 1e3) * (round % 2 ? -1 : 1), v = log_uniform(0.1, 500);
    const double a = log_uniform(1, 5000), j = log_uniform(10, 1e6);
    const SCurve curve(d, v, a, j);
    const double h = curve.duration_s() / kSteps, noise = 1e-13 * std::abs(d);
    double q[4] = {0, 0, 0, 0};
    for (int i = -3; i <= kSteps + 3; ++i) {
      for (int k = 3; k > 0; --k) q[k] = q[k - 1];
      q[0] = curve.at(i * h);
      if (i < 0) continue;
      ASSERT_GE((q[0] - q[1]) * (d > 0 ? 1 : -1), -noise);
      ASSERT_LE(std::abs(q[0] - q[1]), v * h * (1 + 1e-9) + noise);
      ASSERT_LE(std::abs(q[0] - 2 * q[1] + q[2]), a * h * h * (1 + 1e-9) + 4 * noise);
      ASSERT_LE(std::abs(q[0] - 3 * q[1] + 3 * q[2] - q[3]), j * h * h * h * (1 + 1e-9) + 8 * noise);
    }
    ASSERT_EQ(curve.at(curve.duration_s()), d);
    ASSERT_EQ(curve.at(0), 0);
    ASSERT_NEAR(curve.at(curve.duration_s() / 2), d / 2, 1e-9 * std::abs(d));
  }
}

TEST(SCurve, NoWayTakesNoTime) {
  const SCurve curve(0, 20, 50, 400);
  EXPECT_EQ(curve.duration_s(), 0);
  EXPECT_EQ(curve.at(0), 0);
}

}  // namespace
}  // namespace trn
