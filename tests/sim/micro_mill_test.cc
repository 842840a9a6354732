#include <gtest/gtest.h>

#include <cmath>

#include "core/axes.h"
#include "core/fault.h"
#include "core/ports.h"
#include "core/units.h"
#include "sim/micromill/guide_friction.h"
#include "sim/micromill/micro_mill_drives.h"
#include "sim/micromill/micro_mill_plant.h"
#include "sim/micromill/milling_cutter.h"
#include "sim/micromill/part_surface.h"

namespace trn {
namespace {

using Eigen::Vector2d;
using Shape = PartSurface::Shape;

TEST(GuideFriction, SlidesAtItsLevels) {
  const GuideFriction::Config config{1.2, 1.5, 1.6, 2.0, 2.0, 0.01, 300, 0.3};
  for (const double v : {0.05, 1.0, 5.0, 50.0}) {
    for (const double sign : {1.0, -1.0}) {
      GuideFriction friction(config);
      double force = 0;
      for (int i = 0; i < 200000; ++i) force = friction.step(sign * v, 2e-5);
      const bool up = sign > 0;
      const double coulomb = up ? 1.2 : 1.5, at_rest = up ? 1.6 : 2.0;
      const double level = coulomb + (at_rest - coulomb) * std::exp(-v * v / 4);
      EXPECT_NEAR(force, sign * (level + 0.01 * v), 1e-3) << sign * v;
      EXPECT_NEAR(friction.sliding_N(sign * v), sign * (level + 0.01 * v), 1e-12);
    }
  }
}

// Before it slides it is a spring: what it holds after a small push back is less, not zero.
TEST(GuideFriction, HoldsAtRestWhatItHeldBefore) {
  GuideFriction friction({1.2, 1.5, 1.6, 2.0, 2.0, 0, 300, 0});
  for (int i = 0; i < 100000; ++i) friction.step(1.0, 2e-5);
  const double sliding = friction.step(0, 2e-5);
  EXPECT_GT(sliding, 1.2);
  double held = 0;
  for (int i = 0; i < 50; ++i) held = friction.step(-1.0, 2e-5);  // 1 um back
  // The bristles bend towards the level of the other direction: dF/dx = (level + F) 300 / level.
  const double up = 1.2 + 0.4 * std::exp(-0.25), down = 1.5 + 0.5 * std::exp(-0.25);
  EXPECT_NEAR(sliding, up, 1e-3);
  EXPECT_NEAR(held + down, (up + down) * std::exp(-300 * 0.001 / down), 1e-3);
}

TEST(PartSurface, MeasuresRoundAndSquareParts) {
  for (const Shape shape : {Shape::kRound, Shape::kSquare}) {
    PartSurface part({shape});
    for (int i = 0; i < 200000; ++i) {
      const double angle = 2 * kPi * i / 200000, c = std::cos(angle), s = std::sin(angle);
      if (shape == Shape::kRound)
        part.cut(Vector2d(5 * c, 5 * s));
      else
        part.cut(Vector2d(3.9 * c, 4.1 * s) / std::max(std::abs(c), std::abs(s)));  // nearly square
    }
    if (shape == Shape::kRound) {
      EXPECT_NEAR(part.diameter_mm(), 10, 1e-9);
    } else {
      EXPECT_NEAR(part.width_mm(0), 7.8, 1e-9);
      EXPECT_NEAR(part.width_mm(1), 8.2, 1e-9);
    }
  }
  EXPECT_TRUE(std::isnan(PartSurface({Shape::kRound}).diameter_mm()));
}

MillingCutter::Config rigid_cutter() {
  MillingCutter::Config cutter;
  cutter.stiffness_N_mm = {1e9, 1e9};
  cutter.runout_mm = 0;
  cutter.helix_rad = 0.1;
  cutter.edge_ramp_mm = 1e-6;
  return cutter;
}

// Mean force of a slot (Altintas, Manufacturing Automation, 2.8: entry 0, exit pi): along the feed and
// across.
TEST(MillingCutter, MeanForceOfASlotIsTheClosedForm) {
  const MillingCutter::Config config = rigid_cutter();
  MillingCutter cutter(config);
  PartSurface plate({Shape::kRound, {0, 1000}});
  const double feed_mm_s = 4.8, depth_mm = 0.1;
  Vector2d sum = Vector2d::Zero();
  int count = 0;
  for (int i = 0; i < 48000; ++i) {
    const Vector2d force = cutter.step({feed_mm_s * config.step_s * i, 0}, depth_mm, plate);
    if (i < 4800) continue;
    sum += force;
    ++count;
  }
  const double teeth = MillingCutter::kTeeth;
  const double feed_tooth = feed_mm_s * 2 * kPi / config.spindle_rad_s / teeth;
  const double across =
      teeth * depth_mm * (config.tangential_N_mm2 * feed_tooth / 4 + config.edge_tangential_N_mm / kPi);
  const double against =
      teeth * depth_mm * (config.radial_N_mm2 * feed_tooth / 4 + config.edge_radial_N_mm / kPi);
  EXPECT_NEAR(sum.x() / count, -against, 0.02 * against);
  EXPECT_NEAR(sum.y() / count, across, 0.02 * across);
}

// A rigid tool leaves the nominal part but for the feed marks; run-out makes it smaller by itself.
TEST(MillingCutter, ARigidToolCutsTheNominalPart) {
  for (const double runout : {0.0, 0.003}) {
    MillingCutter::Config config = rigid_cutter();
    config.runout_mm = runout;
    MillingCutter cutter(config);
    PartSurface part({Shape::kRound});
    const double radius = 3.5, feed_mm_s = 4.8;
    const int steps = static_cast<int>(1.02 * 2 * kPi * radius / feed_mm_s / config.step_s);
    for (int i = 0; i < steps; ++i) {
      const double angle = kPi - feed_mm_s * config.step_s * i / radius;
      cutter.step({radius * std::cos(angle), radius * std::sin(angle)}, 0.1, part);
    }
    EXPECT_NEAR(part.diameter_mm(), 6 - 2 * runout, 4e-4) << runout;
  }
}

TEST(MicroMillPlant, FollowsAndIsDeterministic) {
  const auto end = [](std::uint64_t seed) {
    MicroMillPlant plant(micro_mill_plant(seed, 0.001));
    double worst = 0;
    for (int k = 0; k < 3000; ++k) {
      const double x = 5 * std::sin(0.002 * k), y = 3 * (1 - std::cos(0.002 * k));
      plant.step({x, y, 1});
      if (k > 300)
        worst = std::max({worst, std::abs(plant.axis(0).x_mm() - x), std::abs(plant.axis(1).x_mm() - y)});
    }
    EXPECT_LT(worst, 0.02);
    return plant.axis(0).x_mm();
  };
  EXPECT_EQ(end(3), end(3));
  EXPECT_NE(end(3), end(4));
}

TEST(MicroMillPlant, TheBlockPushesBackWithTheToolsStiffness) {
  const MicroMillPlant::Config config = micro_mill_plant(0, 0.001);
  MicroMillPlant plant(config);
  plant.axis(0).place(26.9);
  plant.set_block(true);
  for (int k = 0; k < 1500; ++k) plant.step({26.9 + std::min(0.2, 0.0002 * k), 0, 1});
  EXPECT_NEAR(plant.tool_force_N().x(), -config.cutter.stiffness_N_mm.x() * 0.1, 0.05);
  EXPECT_NEAR(plant.deflection_mm().x(), -0.1, 0.001);
}

TEST(MicroMillDrives, AFollowingErrorIsAFault) {
  MicroMillDrives drives({micro_mill_plant(0, 0.001), std::nullopt, 0.5});
  Setpoints setpoints{JointVec::Zero(3), JointVec::Zero(3)};
  Feedback feedback;
  drives.exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kOff);
  drives.bring_up();
  for (int k = 0; k < 100; ++k) drives.exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kEnabled);
  EXPECT_EQ(feedback.current_A.size(), 3);
  setpoints.q[1] = 2;
  drives.exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kFault);
  EXPECT_EQ(feedback.fault, Fault::kFollowingError);
  EXPECT_EQ(feedback.fault_joint, 1);
}

}  // namespace
}  // namespace trn
