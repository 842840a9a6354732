#include "core/differencer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

constexpr double kT = 0.001;

// The differences of a polynomial of third degree: of q = j t^3 / 6 the jerk is exact everywhere,
// acceleration and velocity are those of places in between.
TEST(Differencer, FindsTheDerivativesOfAPolynomial) {
  Differencer differencer;
  const auto q = [](double t) { return 5 + 3 * t + 40 * t * t / 2 + 1000 * t * t * t / 6; };
  Derivatives d;
  for (int k = 0; k < 10; ++k) d = differencer.next(q(k * kT), kT);
  const double t = 9 * kT;
  EXPECT_NEAR(d.jerk, 1000, 1e-4);
  EXPECT_NEAR(d.acceleration, 40 + 1000 * (t - kT), 1e-6);
  EXPECT_NEAR(d.velocity, 3 + 40 * (t - kT / 2) + 1000 * (t * t - t * kT + kT * kT / 3) / 2, 1e-9);
  EXPECT_EQ(differencer.value(), q(t));
}

TEST(Differencer, TakesTheFirstSampleAsRest) {
  Differencer differencer;
  for (int k = 0; k < 5; ++k) {
    const Derivatives d = differencer.next(0.1 * 3, kT);
    EXPECT_EQ(d.velocity, 0);
    EXPECT_EQ(d.acceleration, 0);
    EXPECT_EQ(d.jerk, 0);
  }
  const Derivatives jump = differencer.next(0.3 + kT, kT);
  EXPECT_NEAR(jump.velocity, 1, 1e-9);
  EXPECT_NEAR(jump.jerk, 1 / kT / kT, 1e-3);
}

TEST(Differencer, RestartsWhereItStands) {
  Differencer differencer;
  differencer.next(1, kT);
  differencer.next(2, kT);
  differencer.restart();
  EXPECT_EQ(differencer.next(7, kT).velocity, 0);
  EXPECT_NEAR(differencer.next(7 + 2 * kT, kT).velocity, 2, 1e-9);
}

}  // namespace
}  // namespace trn
