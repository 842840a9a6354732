#include "app/session/feature_meter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/units.h"

namespace trn {
namespace {

ProgramMove arc(std::uint32_t line, double radius_mm, double from_rad, double sweep_rad) {
  ProgramMove move;
  move.kind = ProgramMove::Kind::kArc;
  move.from.setZero();
  move.arc_centre = Vec3(1, 2, 0);
  move.from.head<3>() = move.arc_centre + radius_mm * Vec3(std::cos(from_rad), std::sin(from_rad), 0);
  move.to = move.from;
  move.arc_sweep_rad = sweep_rad;
  move.source.line = line;
  return move;
}

ProgramMove cut(std::uint32_t line, const Vec3& from, const Vec3& to) {
  ProgramMove move;
  move.kind = ProgramMove::Kind::kFeed;
  move.from.setZero();
  move.to.setZero();
  move.from.head<3>() = from;
  move.to.head<3>() = to;
  move.source.line = line;
  return move;
}

CycleReport at(std::uint32_t line, const Vec3& place, const Eigen::Vector2d& bent_mm) {
  CycleReport report;
  report.on_path = true;
  report.line = line;
  report.y.head<3>() = place;
  report.tool_load.deflection_mm = bent_mm;
  report.tool_load.known = true;
  return report;
}

// Bending along a fixed direction leaves a circle's size alone; bending outward adds twice to its diameter.
TEST(FeatureMeter, OutwardBendingMakesACircleLarger) {
  FeatureMeter meter;
  meter.programmed(arc(7, 5, 0, -2 * kPi));
  for (int i = 0; i < 1000; ++i) {
    const double angle = -2 * kPi * i / 1000;
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle));
    meter.sample(at(7, Vec3(1 + 5 * out.x(), 2 + 5 * out.y(), -1), 0.03 * out + Eigen::Vector2d(0.5, -0.2)));
  }
  const auto features = meter.features();
  ASSERT_EQ(features.size(), 1u);
  EXPECT_TRUE(features[0].circle);
  EXPECT_NEAR(features[0].size_mm, 10, 1e-12);
  EXPECT_NEAR(features[0].bending_mm, 0.03, 1e-9);
  EXPECT_NEAR(features[0].predicted_mm(), 10.06, 1e-9);
  EXPECT_EQ(features[0].unknown, 0);
}

// What the correction shifts counts with the bending.
TEST(FeatureMeter, ACutIsOffByBendingAndCorrection) {
  FeatureMeter meter;
  meter.programmed(cut(3, {0, 0, 0}, {10, 0, 0}));
  meter.programmed(cut(4, {10, 0, 0}, {10, 10, 0}));
  for (int i = 0; i < 100; ++i) {
    CycleReport report = at(3, {0.1 * i, 0, 0}, {0.7, 0.05});
    report.tool_load.shift_mm = {0, -0.04};
    report.tool_load.known = i >= 25;
    meter.sample(report);
  }
  for (int i = 0; i < 100; ++i) meter.sample(at(4, {10, 0.1 * i, 0}, {0.7, 0.05}));
  const auto features = meter.features();
  ASSERT_EQ(features.size(), 2u);
  EXPECT_NEAR(features[0].bending_mm, 0.05, 1e-12);
  EXPECT_NEAR(features[0].offset_mm, 0.01, 1e-12);
  EXPECT_NEAR(features[0].unknown, 0.25, 1e-12);
  EXPECT_NEAR(features[1].bending_mm, -0.7, 1e-12);
}

TEST(FeatureMeter, ArcsOfOneCircleAreOneFeatureAndOpenArcsAreNone) {
  FeatureMeter meter;
  meter.programmed(arc(1, 5, 0, 0.5));
  meter.programmed(cut(2, {0, 0, 0}, {0, 3, 0}));
  meter.programmed(arc(3, 5, 0, kPi));
  meter.programmed(arc(4, 5, kPi, kPi));
  meter.programmed(arc(5, 6, 0, 2 * kPi));
  for (std::uint32_t line = 1; line <= 5; ++line)
    meter.sample(at(line, Vec3(6, 2, 0), Eigen::Vector2d(0.1 * line, 0)));
  const auto features = meter.features();
  ASSERT_EQ(features.size(), 3u);
  EXPECT_FALSE(features[0].circle);
  EXPECT_EQ(features[1].line, 3u);
  EXPECT_EQ(features[1].last_line, 4u);
  EXPECT_NEAR(features[1].bending_mm, 0.35, 1e-12);
  EXPECT_NEAR(features[2].size_mm, 12, 1e-12);
}

// A cut of a millimetre is measured, a shorter one is part of a contour.
TEST(FeatureMeter, ShortCutsAreNoFeatures) {
  FeatureMeter meter;
  meter.programmed(cut(3, {0, 0, 0}, {0.999, 0, 0}));
  meter.programmed(cut(4, {0, 0, 0}, {1, 0, 0}));
  for (const std::uint32_t line : {3u, 4u}) meter.sample(at(line, {0, 0, 0}, {0, 0.05}));
  const auto features = meter.features();
  ASSERT_EQ(features.size(), 1u);
  EXPECT_EQ(features[0].line, 4u);
}

}  // namespace
}  // namespace trn
