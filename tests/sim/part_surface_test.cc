#include "sim/micromill/part_surface.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

using Eigen::Vector2d;
constexpr double kPi = 3.14159265358979323846;

Vector2d round_about(const Vector2d& middle, double radius, double angle) {
  return middle + radius * Vector2d(std::cos(angle), std::sin(angle));
}

// A part measures the same wherever it lies.
TEST(PartSurface, IsMeasuredFromItsOwnMiddle) {
  const Vector2d middle(7, -3);
  PartSurface round({PartSurface::Shape::kRound, middle}), square({PartSurface::Shape::kSquare, middle});
  EXPECT_NEAR(round.distance_mm({10, 1}), 5, 1e-12);
  EXPECT_NEAR(square.distance_mm({10, 1}), 4, 1e-12);
  EXPECT_NEAR(square.distance_mm({1, -3}), 6, 1e-12);
  for (int i = 0; i < 100000; ++i) {
    const double angle = 2 * kPi * i / 100000, c = std::cos(angle), s = std::sin(angle);
    round.cut(round_about(middle, 5, angle));
    square.cut(middle + Vector2d(3.9 * c, 4.1 * s) / std::max(std::abs(c), std::abs(s)));
  }
  EXPECT_NEAR(round.diameter_mm(), 10, 1e-9);
  EXPECT_NEAR(square.width_mm(0), 7.8, 1e-9);
  EXPECT_NEAR(square.width_mm(1), 8.2, 1e-9);
  for (const double distance : round.distances_mm()) ASSERT_NEAR(distance, 5, 1e-9);
}

// Bin i is at 2 pi (i + 1/2) / bins.
TEST(PartSurface, EveryAngleHasItsPlace) {
  const Vector2d middle(7, -3);
  PartSurface part({PartSurface::Shape::kRound, middle, 360});
  for (int i = 0; i < 360; ++i) part.cut(round_about(middle, 4 + 0.001 * i, 2 * kPi * (i + 0.5) / 360));
  for (int i = 0; i < 360; ++i)
    ASSERT_NEAR(part.distances_mm()[static_cast<std::size_t>(i)], 4 + 0.001 * i, 1e-9);
}

// What was cut between two radii is gone once the tool is well past, either way round; beside it is material.
TEST(PartSurface, WhereTheToolHasPassedThereIsNoMaterial) {
  for (const double sense : {1.0, -1.0}) {
    const Vector2d middle(-2, 6);
    PartSurface part({PartSurface::Shape::kRound, middle});
    for (int i = 0; i <= 4000; ++i) {
      const double angle = sense * kPi / 2 * i / 4000;
      EXPECT_TRUE(part.cut(round_about(middle, 5, angle)));
      EXPECT_TRUE(part.cut(round_about(middle, 6, angle)));
      part.settle(round_about(middle, 5.5, angle));
    }
    EXPECT_FALSE(part.cut(round_about(middle, 5.5, sense * kPi / 4)));
    EXPECT_TRUE(part.cut(round_about(middle, 4.9, sense * kPi / 4)));
    EXPECT_TRUE(part.cut(round_about(middle, 6.1, sense * kPi / 4)));
    EXPECT_TRUE(part.cut(round_about(middle, 5.5, sense * kPi / 2))) << "the tool is still there";
    EXPECT_TRUE(part.cut(round_about(middle, 5.5, -sense * kPi / 4))) << "not yet reached";
  }
}

// About -x the tool comes and goes: its mark there is no part of the diameter, one elsewhere is.
TEST(PartSurface, TheMarkOfTheToolsWayInIsLeftOut) {
  for (const double mark : {kPi, 0.0}) {
    PartSurface part({PartSurface::Shape::kRound});
    for (int i = 0; i < 100000; ++i) {
      const double angle = 2 * kPi * i / 100000;
      const bool marked = std::abs(std::remainder(angle - mark, 2 * kPi)) < 0.2;
      part.cut(round_about({0, 0}, marked ? 4 : 5, angle));
    }
    const double share = 0.4 / (2 * kPi - 2 * PartSurface::kMarkRad);
    EXPECT_NEAR(part.diameter_mm(), mark == 0 ? 10 - 2 * share : 10, 0.002);
  }
}

TEST(PartSurface, HasNoSizeBeforeItIsCut) {
  PartSurface part({PartSurface::Shape::kSquare});
  for (const double x : {-1.0, 1.0})
    for (int i = -1000; i <= 1000; ++i) part.cut({x, 0.001 * i});
  EXPECT_NEAR(part.width_mm(0), 2, 1e-9);
  EXPECT_TRUE(std::isnan(part.width_mm(1)));
  EXPECT_TRUE(std::isnan(part.diameter_mm()));
}

}  // namespace
}  // namespace trn
