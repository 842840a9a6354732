#include "compensation/spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace trn {
namespace {

TEST(Spline, PassesThroughItsPointsAndIsSmooth) {
  const std::vector<double> x{0, 1, 3, 4, 7}, y{0, 2, -1, 1, 1};
  const Spline spline(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(spline.at(x[i]), y[i], 1e-14);
  constexpr double kH = 1e-4;
  for (double at = -1; at < 8; at += 0.01) {
    EXPECT_NEAR((spline.at(at + kH) - spline.at(at - kH)) / (2 * kH), spline.slope(at), 1e-6) << at;
    // A second derivative with a jump would show as a difference of slopes that does not shrink with the
    // step.
    EXPECT_NEAR(spline.slope(at + kH) - 2 * spline.slope(at) + spline.slope(at - kH), 0, 1e-2 * kH) << at;
  }
}

TEST(Spline, IsNaturalAndStraightBeyondItsEnds) {
  const Spline spline({0, 1, 2}, {0, 1, 0});
  // By hand: the middle's second derivative is -3, the ends' are 0; between 0 and 1: y = 3/2 x - x^3 / 2.
  EXPECT_NEAR(spline.at(0.5), 0.75 - 0.0625, 1e-15);
  EXPECT_NEAR(spline.slope(0), 1.5, 1e-15);
  EXPECT_NEAR(spline.at(-2), -3, 1e-14);
  EXPECT_NEAR(spline.slope(5), -1.5, 1e-14);
  EXPECT_NEAR(spline.slope_max(), 1.5, 1e-12);
  EXPECT_EQ(spline.peak(), 1);
}

TEST(Spline, OfOnePointIsAConstantAndOfNoneZero) {
  EXPECT_EQ(Spline({3}, {7}).at(-100), 7);
  EXPECT_EQ(Spline({3}, {7}).slope(3), 0);
  EXPECT_EQ(Spline().at(5), 0);
  EXPECT_TRUE(Spline().empty());
}

TEST(Spline, RefusesPointsThatDoNotRise) {
  EXPECT_THROW(Spline({0, 0}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(Spline({0, 1}, {1}), std::invalid_argument);
}

TEST(Spline, PeriodicGoesOnAsItBegan) {
  std::vector<double> x, y;
  for (int i = 0; i <= 24; ++i) {
    x.push_back(i * 0.25);
    y.push_back(std::sin(i * 0.25 * 2 * 3.14159265358979323846 / 6));
  }
  y.back() = y.front();
  const Spline spline = Spline::periodic(x, y);
  for (double at = 0; at < 6; at += 0.1) {
    EXPECT_NEAR(spline.at(at), spline.at(at + 6), 1e-12);
    EXPECT_NEAR(spline.at(at), spline.at(at - 12), 1e-12);
  }
  EXPECT_NEAR(spline.slope(6 - 1e-9), spline.slope(1e-9), 1e-7);
}

}  // namespace
}  // namespace trn
