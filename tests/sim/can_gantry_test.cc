#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/gantry.h"
#include "hal/can/gantry_link.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"

// One joint on two motors, each with a plant of its own: squaring, going together, stopping together.
namespace trn {
namespace {

using Trouble = EmulatedNode::Trouble;
constexpr int kLeft = 2, kRight = 3, kY = 1;  // nodes and joint of configs/gantry_router.toml

/// The gantry router; what its plants do is the truth.
class GantryField : public Field {
 public:
  explicit GantryField(const Edits& edits = {}) : Field("gantry_router.toml", edits) {}
  double left() { return node(kLeft).drive().joint().true_place(); }
  double right() { return node(kRight).drive().joint().true_place(); }
  double askew() { return std::abs(left() - right()); }
  void run(int periods) {
    for (int i = 0; i < periods; ++i) {
      tick();
      worst_ = std::max(worst_, askew());
    }
  }
  /// Greatest distance since the last call, mm.
  double worst() { return std::exchange(worst_, 0); }

 private:
  double worst_ = 0;
};

TEST(Gantry, HomesSquareAndStaysSquare) {
  GantryField field;
  const double before = field.askew();
  EXPECT_NEAR(before, 0.8, 1e-9) << "as it hangs at power-on";
  field.start();
  EXPECT_FALSE(field.feedback.homed_mask >> kY & 1u);
  field.home();
  EXPECT_NEAR(field.left(), -1240, 2e-3) << "home_final_mm";
  EXPECT_NEAR(field.feedback.q[kY], field.left(), 1e-3);
  const double standing = field.askew();
  EXPECT_LT(standing, 3e-4) << "counts of the encoders";
  field.worst();
  field.setpoints.qd[kY] = 200;
  field.run(300);
  field.setpoints.qd[kY] = 0;
  field.run(200);
  EXPECT_NEAR(field.left(), field.setpoints.q[kY], 1e-3);
  const double moving = field.worst();
  EXPECT_LT(moving, 1e-3);
  EXPECT_EQ(field.feedback.fault, Fault::kOk);
  std::printf(
      "gantry: %.3f mm askew at power-on; squared %.4f mm standing, %.4f mm at 200 mm/s and its ramps\n",
      before, standing, moving);
}

// Feed-forward of the joint: each motor goes as fast as the joint and takes half of its force, in its own
// sense.
// As behind the alarm of another drive, while the plan still stops on its path.
TEST(Gantry, GoesOnThroughAReset) {
  GantryField field;
  field.start();
  field.home();
  field.setpoints.qd[kY] = 200;
  field.run(100);
  const double from = field.left();
  for (int i = 0; i < 100; ++i) {
    if (i % 30 == 0) field.reset();
    field.run(1);
    ASSERT_TRUE(field.enabled()) << i;
  }
  EXPECT_NEAR(field.left() - from, 200 * 100 * field.period_s(), 0.1);
}

TEST(Gantry, EachMotorTakesItsShareOfTheForce) {
  GantryField field({{"counts_per_mm = 10000", "counts_per_mm = 10000\nrated_force_N = 1000.0"},
                     {"period_s = 0.002", "period_s = 0.004"},
                     {"[planner]",
                      "[feed_forward]\n[[feed_forward.joint]]\njoint = \"Y\"\ninertia_kg = 300.0\n\n"
                      "[planner]"}});
  field.start();
  field.home();
  field.setpoints.velocity_offset = field.setpoints.force_offset = JointVec::Zero(3);
  field.setpoints.qd[kY] = field.setpoints.velocity_offset[kY] = 50;
  field.setpoints.force_offset[kY] = 600;
  field.run(10);
  const auto told = [&](int node, std::uint16_t index) {
    return field.node(node).store().integer({index, 0});
  };
  EXPECT_EQ(told(kLeft, 0x60B2), 300);    // thousandths of 1000 N
  EXPECT_EQ(told(kRight, 0x60B2), -300);  // this motor turns the other way
  EXPECT_EQ(told(kLeft, 0x60B1), 500000);
  EXPECT_EQ(told(kRight, 0x60B1), -500000);
}

// Without square_mm the gantry is drawn to the switches as they stand: the config's figure is what squares
// it.
TEST(Gantry, WithoutItsOffsetItIsAsAskewAsItsSwitches) {
  GantryField field(Edits{{"square_mm = 0.35\n", ""}});
  field.start();
  field.home();
  EXPECT_NEAR(field.askew(), 0.35, 1e-3);
}

TEST(Gantry, KeepsItsShapeUntilItIsHomed) {
  GantryField field;
  field.start();
  const double before = field.askew();
  field.setpoints.qd[kY] = 50;
  field.run(200);
  field.setpoints.qd[kY] = 0;
  field.run(100);
  EXPECT_NEAR(field.askew(), before, 1e-3);
  EXPECT_NEAR(field.left(), -1170 + 20, 2e-3);
  EXPECT_LT(field.worst(), before + 1e-3);
}

// Switched off, one side sags; at power-on it is drawn back no faster than the config says.
TEST(Gantry, IsDrawnSquareSlowlyAtPowerOn) {
  GantryField field;
  field.start();
  field.home();
  field.drives.shut_down();
  field.run(50);
  field.drives.bring_up();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 500), 0);
  EXPECT_LT(field.askew(), 1e-3);
}

TEST(Gantry, OneSideHeldIsAFaultThatStopsBoth) {
  GantryField field;
  field.start();
  field.home();
  field.setpoints.qd[kY] = 100;
  field.run(100);
  field.trouble(kRight, Trouble::kHeld, 1);
  const double from = field.right();
  const int periods = field.until([&] { return field.feedback.fault != Fault::kOk; }, 100);
  // 1 mm apart at 100 mm/s is 10 ms; a period of 2 ms for the feedback, one for the bus.
  EXPECT_GE(periods, 5);
  EXPECT_LE(periods, 8);
  EXPECT_EQ(field.feedback.fault, Fault::kGantryParted);
  EXPECT_EQ(field.feedback.fault_joint, kY);
  EXPECT_NE(field.drives.explain_fault(kY).find("1 are allowed"), std::string::npos)
      << field.drives.explain_fault(kY);
  field.drives.quick_stop();  // as the tick does
  field.run(200);
  EXPECT_LT(field.left() - from, 4.5) << "100 mm/s: 1 mm until it is told, and its ramp of 1.25 mm";
  const double rest = field.left();
  field.run(200);
  EXPECT_EQ(field.left(), rest);
  std::printf("gantry: held side found after %d periods, sides %.3f mm apart at rest\n", periods,
              field.askew());
}

/// Periods from a fault of one motor until the other is told to stop.
int periods_until_halt(Trouble kind, std::int64_t value) {
  GantryField field;
  field.start();
  field.home();
  field.setpoints.qd[kY] = 100;
  field.run(100);
  field.trouble(kRight, kind, value);
  int periods = 0;
  // Bit 2 at 0 with bit 1 at 1: quick stop (CiA 402-2, 8.4.1).
  while ((field.node(kLeft).store().integer({0x6040, 0}) & 6) != 2 && periods < 50) {
    field.tick();
    ++periods;
  }
  EXPECT_NE(field.feedback.fault, Fault::kOk);
  return periods;
}

// Without anybody's reaction: the tick would order it a period later.
TEST(Gantry, TheOthersStopInThePeriodThatHearsOfIt) {
  const int fault = periods_until_halt(Trouble::kFault, 0x3210);
  const int silent = periods_until_halt(Trouble::kSilent, 1);
  EXPECT_LE(fault, 3);
  EXPECT_LE(silent, 6) << "missed_max = 3";
  std::printf(
      "gantry: the other motor is told to stop %d periods after a drive's fault, %d after its silence\n",
      fault, silent);
}

TEST(Gantry, ADeadSwitchTwistsItNoFartherThanAllowed) {
  GantryField field;
  field.start();
  field.node(kRight).drive().joint().set_home_switch_dead(true);
  field.drives.request_home(7);
  field.tick();
  ASSERT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 40000), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kGantryParted);
  field.drives.quick_stop();
  field.run(300);
  EXPECT_LT(field.askew(), 5 + 0.8 + 0.5) << "apart_homing_mm, how it hung, and the ramp";
}

TEST(Gantry, OneOfItsMotorsNotHomedIsTheJointNotHomed) {
  GantryField field;
  field.start();
  field.home();
  field.trouble(kRight, Trouble::kReset, 0);
  field.until([&] { return field.feedback.fault != Fault::kOk; }, 100);
  field.drives.quick_stop();
  field.run(300);
  field.reset();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 1000), 0) << field.drives.explain_fault(-1);
  EXPECT_EQ(field.feedback.homed_mask >> kY & 1u, 0u);
  EXPECT_EQ(field.feedback.homed_mask & 1u, 1u);
}

std::string refusal(const Edits& edits) {
  try {
    GantryField field(edits);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(GantryConfig, RefusesWhatCannotBe) {
  EXPECT_NE(refusal({{"[[drives.gantry]]\njoint = \"Y\"", "[[drives.gantry]]\njoint = \"X\""},
                     {"square_mm = 0.35\n", ""}})
                .find("needs a [[drives.gantry]]"),
            std::string::npos);
  EXPECT_NE(refusal({{"square_mm = 0.35\nhome_group = 1", "home_group = 2"}}).find("the same home_group"),
            std::string::npos);
  EXPECT_NE(refusal({{"home_mm = 99.0\n", "home_mm = 99.0\nsquare_mm = 0.1\n"}}).find("out of square"),
            std::string::npos);
  EXPECT_NE(refusal({{"apart_mm = 1.0", "apart_mm = -1.0"}}).find("apart_mm"), std::string::npos);
}

}  // namespace
}  // namespace trn
