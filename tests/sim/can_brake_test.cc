#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/fault.h"
#include "core/ports.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"

// The Z of configs/gantry_router.toml hangs: where neither brake nor drive holds it, it falls.
namespace trn {
namespace {

using Trouble = EmulatedNode::Trouble;
constexpr int kZ = 2, kNode = 0;   // joint, node
constexpr double kCount = 3e-4;    // mm, three counts
constexpr double kGravity = 9810;  // mm/s^2
constexpr const char* kClose = "close_s = 0.06";

class HangingField : public Field {
 public:
  explicit HangingField(const Edits& edits = {}) : Field("gantry_router.toml", edits) {}
  double z() { return node(kNode).drive().joint().true_place(); }
  /// How far it falls, at most, in so many periods.
  double drop_in(int periods) {
    const double from = z();
    double lowest = from;
    for (int i = 0; i < periods; ++i) {
      tick();
      lowest = std::min(lowest, z());
    }
    return from - lowest;
  }
};

TEST(HangingAxis, DoesNotDropWhenItGetsPower) {
  HangingField field;
  field.drives.bring_up();
  const double from = field.z();
  int periods = 0;
  while (!field.enabled() && ++periods < 400) {
    field.tick();
    ASSERT_NEAR(field.z(), from, kCount) << periods;
  }
  EXPECT_GE(periods, 40) << "0.08 s of release_s";
  EXPECT_LT(field.drop_in(500), kCount);
}

TEST(HangingAxis, DoesNotDropWhenItIsSwitchedOff) {
  HangingField field;
  field.start();
  field.drives.shut_down();
  EXPECT_LT(field.drop_in(10), kCount);
  EXPECT_EQ(field.feedback.state, DriveState::kQuickStop) << "it is held until the brake holds it";
  EXPECT_LT(field.drop_in(1000), kCount);
  EXPECT_EQ(field.feedback.state, DriveState::kOff);
}

TEST(HangingAxis, DoesNotDropBehindAQuickStop) {
  HangingField field;
  field.start();
  field.home();
  field.setpoints.qd[kZ] = -100;
  for (int i = 0; i < 200; ++i) field.tick();
  field.drives.quick_stop();
  for (int i = 0; i < 30; ++i) field.tick();  // its ramp
  EXPECT_LT(field.drop_in(1000), kCount);
  EXPECT_EQ(field.feedback.state, DriveState::kOff);
  field.drives.bring_up();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 1000), 0);
}

// A reset behind an alarm for which no drive lost its torque, as that of a safety input.
TEST(HangingAxis, DoesNotDropWhenItIsResetWithPower) {
  HangingField field;
  field.start();
  field.home();
  for (int i = 0; i < 3; ++i) {
    field.reset();
    EXPECT_LT(field.drop_in(300), kCount);
    EXPECT_TRUE(field.enabled());
  }
}

// The bring-up behind a fault of the nodes ends before the next period here: their messages of that time are
// old then, and no reason to set them up once more at the next reset, which takes their torque.
TEST(HangingAxis, DoesNotDropAtTheResetBehindASetup) {
  HangingField field;
  field.start();
  field.home();
  for (int node = 0; node < 4; ++node) field.trouble(node, Trouble::kPreOperational, 1);
  ASSERT_GE(field.until([&] { return field.feedback.fault == Fault::kDriveDropped; }, 100), 0);
  field.drives.quick_stop();
  for (int i = 0; i < 200; ++i) field.tick();
  for (int i = 0; i < 3; ++i) {
    field.reset();
    EXPECT_LT(field.drop_in(300), kCount) << i;
    EXPECT_TRUE(field.enabled()) << i;
  }
}

// A reset that comes at once waits for the brake. Here nobody ticks meanwhile, so it waits in vain.
TEST(HangingAxis, ADriveIsSetUpWhenItsBrakeHolds) {
  HangingField field;
  field.start();
  field.home();
  const double from = field.z();
  field.trouble(kNode, Trouble::kSilent, 1);
  ASSERT_GE(field.until([&] { return field.feedback.fault == Fault::kDriveLost; }, 100), 0);
  field.drives.quick_stop();
  field.trouble(kNode, Trouble::kSilent, 0);
  try {
    field.reset();
    ADD_FAILURE() << "set up with an open brake";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("its brake has not been closed for 2."), std::string::npos)
        << error.what();
  }
  for (int i = 0; i < 200; ++i) field.tick();
  field.reset();
  EXPECT_LT(field.drop_in(300), kCount);
  EXPECT_TRUE(field.enabled());
  EXPECT_NEAR(field.z(), from, 0.01);
}

// The emulation is no friend of ours: told that the brake takes no time, the drive lets go and the axis
// falls.
TEST(HangingAxis, FallsWhenTheConfigIsWrongAboutTheBrake) {
  HangingField field(Edits{{kClose, "close_s = 0.0"}});
  field.start();
  field.drives.shut_down();
  const double drop = field.drop_in(1000);
  EXPECT_GT(drop, 2);
  EXPECT_LT(drop, 0.5 * kGravity * 0.05 * 0.05);
}

// Torque that is gone is gone: what is left is the time of the brake itself, and of the bus.
TEST(HangingAxis, DropsByTheBrakesOwnTimeWhenItsDriveFaults) {
  for (const auto& [name, kind] : {std::pair{"fault", Trouble::kFault}, {"Safe Torque Off", Trouble::kSto}}) {
    HangingField field;
    field.start();
    field.home();
    field.trouble(kNode, kind, kind == Trouble::kFault ? 0x3210 : 1);
    const double drop = field.drop_in(50);
    field.drives.quick_stop();
    EXPECT_LT(field.drop_in(500), kCount);
    const double time_s = 0.04 + 5 * field.period_s();  // brake_close_s, and the way of the frames
    EXPECT_LT(drop, 0.5 * kGravity * time_s * time_s) << name;
    std::printf("hanging axis: drops %.2f mm after %s, with a brake of 40 ms\n", drop, name);
  }
}

TEST(HangingAxis, SafeTorqueOffIsToldAsWhatItIs) {
  HangingField field;
  field.start();
  field.trouble(kNode, Trouble::kSto, 1);
  ASSERT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 20), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kSafeTorqueOff);
  field.drives.quick_stop();
  for (int i = 0; i < 100; ++i) field.tick();
  field.reset();  // while it is still active
  ASSERT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 4000), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kSafeTorqueOff);
  EXPECT_LT(field.drop_in(200), kCount);
}

}  // namespace
}  // namespace trn
