#include "sim/canopen/emulated_drive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "hal/can/cia402.h"
#include "hal/can/eds.h"
#include "sim/canopen/object_store.h"
#include "tests/support/paths.h"

// Objects of CiA 402-2 as the drive fills them; 1000 counts a millimetre, 1 ms a step.
namespace trn {
namespace {

using S = Cia402State;

class EmulatedDrives : public testing::Test {
 protected:
  EmulatedDrives() : store_(load_eds(source_dir() + "/configs/eds/servo.eds", 3)), drive_(config(), store_) {}

  static EmulatedDrive::Config config() {
    EmulatedDrive::Config config;
    config.joint.servo = {1000, 0.7, 1, 0.001};
    config.joint.following_error_max = 10;
    config.joint.quick_stop_deceleration = 1000;
    config.joint.switch_min = -1000;
    config.joint.switch_max = 1000;
    config.joint.homed = true;
    config.counts_per_unit = 1000;
    return config;
  }
  std::int64_t get(std::uint16_t index) const { return store_.integer({index, 0}); }
  void set(std::uint16_t index, std::int64_t value) { store_.set({index, 0}, value); }
  void steps(int count) {
    for (int i = 0; i < count; ++i) drive_.step();
  }
  void enable(Cia402Mode mode) {
    set(0x6060, static_cast<std::int64_t>(mode));
    for (const int control : {0x06, 0x07, 0x0F}) {
      set(0x6040, control);
      steps(2);
    }
    ASSERT_EQ(drive_.state(), S::kOperationEnabled);
  }

  ObjectStore store_;
  EmulatedDrive drive_;
};

// 0x606C in counts a second, 0x6064 in counts.
TEST_F(EmulatedDrives, PlaceAndSpeedAreTold) {
  enable(Cia402Mode::kCyclicPosition);
  for (int k = 1; k <= 500; ++k) {
    set(0x607A, 20 * k);
    steps(1);
  }
  EXPECT_NEAR(static_cast<double>(get(0x6064)), 10000, 2);
  EXPECT_NEAR(static_cast<double>(get(0x606C)), 20000, 20);
  steps(500);
  EXPECT_EQ(get(0x6064), 10000);
  EXPECT_EQ(get(0x606C), 0);
  EXPECT_EQ(get(0x6061), 8);
}

TEST_F(EmulatedDrives, TheFirstFaultIsTheOneThatIsTold) {
  enable(Cia402Mode::kCyclicPosition);
  EXPECT_EQ(drive_.take_emergency(), -1);
  drive_.fail(0x2310);
  EXPECT_EQ(drive_.state(), S::kFaultReactionActive);
  drive_.fail(0x3210);
  EXPECT_EQ(drive_.take_emergency(), 0x2310);
  steps(100);
  EXPECT_EQ(drive_.state(), S::kFault);
  drive_.fail(0x3210);
  EXPECT_EQ(drive_.take_emergency(), -1);
  set(0x6040, 0x80);
  steps(1);
  EXPECT_EQ(drive_.state(), S::kSwitchOnDisabled);
  EXPECT_EQ(drive_.take_emergency(), 0) << "all is well";
}

// 0x60C2: targets every 4 ms, a clock of 1 ms: a quarter of the way each.
TEST_F(EmulatedDrives, InterpolatesOverTheTimeItIsTold) {
  store_.set({0x60C2, 1}, 4);
  store_.set({0x60C2, 2}, -3);
  enable(Cia402Mode::kCyclicPosition);
  for (int k = 1; k <= 100; ++k) {
    set(0x607A, 80 * k);
    steps(4);
  }
  std::int64_t before = get(0x6064);
  set(0x607A, 80 * 101);
  for (int i = 0; i < 4; ++i) {
    steps(1);
    EXPECT_NEAR(static_cast<double>(get(0x6064) - before), 20, 3) << i;
    before = get(0x6064);
  }
}

// 5 mm at 20 mm/s with 400 mm/s^2: 0.05 s up, 0.2 s along, 0.05 s down. Acknowledged by bit 12, reached by
// bit 10.
TEST_F(EmulatedDrives, AProfileIsATrapezoid) {
  enable(Cia402Mode::kProfilePosition);
  set(0x6081, 20'000);
  set(0x6083, 400'000);
  set(0x607A, 5'000);
  steps(10);
  EXPECT_EQ(get(0x6064), 0) << "nobody said go";
  set(0x6040, 0x1F);
  steps(1);
  EXPECT_TRUE(get(0x6041) & 1 << 12);
  EXPECT_FALSE(get(0x6041) & 1 << 10);
  steps(149);
  EXPECT_NEAR(static_cast<double>(get(0x6064)), 2'500, 60) << "half way";
  EXPECT_NEAR(static_cast<double>(get(0x606C)), 20'000, 200);
  int left = 0;
  for (; !(get(0x6041) & 1 << 10) && left < 1000; ++left) steps(1);
  EXPECT_NEAR(left, 150, 15);
  steps(50);
  EXPECT_EQ(get(0x6064), 5'000);
  set(0x607A, 9'000);
  steps(50);
  EXPECT_EQ(get(0x6064), 5'000) << "only the edge of bit 4 counts";
  set(0x6040, 0x0F);
  steps(1);
  EXPECT_FALSE(get(0x6041) & 1 << 12);
}

// A command leads one transition on in a period; a quick stop ends in Switch On Disabled.
TEST_F(EmulatedDrives, CommandsLeadThroughTheStates) {
  set(0x6040, 0x0F);
  for (const S state : {S::kReadyToSwitchOn, S::kSwitchedOn, S::kOperationEnabled, S::kOperationEnabled}) {
    if (state == S::kReadyToSwitchOn) set(0x6040, 0x06);
    steps(1);
    EXPECT_EQ(drive_.state(), state);
    set(0x6040, 0x0F);
  }
  set(0x6040, 0x07);
  steps(1);
  EXPECT_EQ(drive_.state(), S::kSwitchedOn);
  set(0x6040, 0x0F);
  steps(3);
  ASSERT_EQ(drive_.state(), S::kOperationEnabled);
  set(0x6040, 0x02);
  drive_.step();
  EXPECT_TRUE(drive_.state() == S::kQuickStopActive || drive_.state() == S::kSwitchOnDisabled);
  steps(20);
  EXPECT_EQ(drive_.state(), S::kSwitchOnDisabled);
}

// Enable Operation is bit 3; Switch On alone, however long it stands there, gives no power.
TEST_F(EmulatedDrives, SwitchedOnIsNotEnabled) {
  set(0x6040, 0x06);
  steps(2);
  set(0x6040, 0x07);
  steps(20);
  EXPECT_EQ(drive_.state(), S::kSwitchedOn);
}

TEST_F(EmulatedDrives, ALostConnectionIsAFaultOnlyUnderPower) {
  drive_.lose_connection(0x8130);
  EXPECT_EQ(drive_.take_emergency(), -1);
  enable(Cia402Mode::kCyclicPosition);
  drive_.lose_connection(0x8130);
  EXPECT_EQ(drive_.take_emergency(), 0x8130);
}

}  // namespace
}  // namespace trn
