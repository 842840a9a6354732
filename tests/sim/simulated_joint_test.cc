#include "sim/simulated_joint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "core/fault.h"

namespace trn {
namespace {

constexpr double kPeriod_s = 0.001;

// An incremental encoder; the home switch closes below 10, the index lies 1 above its edge.
SimulatedJoint::Config config() {
  SimulatedJoint::Config config;
  config.servo = {400, 0.7, 1, kPeriod_s};
  config.following_error_max = 2;
  config.quick_stop_deceleration = 1000;
  config.acceleration_homing = 500;
  config.speed_search = 50;
  config.speed_index = 5;
  config.home = 10;
  config.index_distance = 1;
  config.switch_min = -100;
  config.switch_max = 100;
  config.start = 30;
  config.start_up_periods = 3;
  config.homing_periods_max = 10000;
  return config;
}

struct Bench {
  Bench() : joint(config()) {
    joint.enable();
    for (int k = 0; k < 10; ++k) joint.step(joint.measured());
  }
  /// Periods in `state`, at most `limit`.
  int periods_in(DriveState state, int limit = 10000) {
    int count = 0;
    while (joint.state() == state && count < limit) {
      joint.step(joint.measured());
      ++count;
    }
    return count;
  }
  SimulatedJoint joint;
};

// 2000 mm/s^2 for 0.05 s add 5 mm to the way of a period; beyond that and the 2 mm of its own it is a jump.
TEST(SimulatedJoint, ASetpointThatItsAccelerationAllowsIsNoJump) {
  for (const auto& [step, fault] : {std::pair{6.9, Fault::kOk}, std::pair{7.1, Fault::kFollowingError}}) {
    SimulatedJoint::Config slow = config();
    slow.servo.period_s = 0.05;
    slow.acceleration_max = 2000;
    SimulatedJoint joint(slow);
    joint.enable();
    for (int k = 0; k < 10; ++k) joint.step(joint.measured());
    joint.step(joint.measured() + step);
    EXPECT_EQ(joint.fault(), fault) << step;
  }
}

TEST(SimulatedJoint, AMassThatGetsPowerStandsStill) {
  SimulatedJoint::Config with_mass = config();
  ServoMechanism::Config mass;
  mass.period_s = kPeriod_s;
  mass.position_gain_1_s = 40;
  mass.inertia = 0.4;
  mass.velocity_gain = 150;
  mass.integral_time_s = 0.02;
  with_mass.mechanism = mass;
  SimulatedJoint joint(with_mass);
  const double place = joint.measured();
  for (int round = 0; round < 2; ++round) {
    joint.enable();
    for (int k = 0; k < 20; ++k) {
      joint.step(place);
      EXPECT_NEAR(joint.measured(), place, 1e-12) << k;
    }
    EXPECT_EQ(joint.state(), DriveState::kEnabled);
    joint.disable();
  }
}

// 50 mm/s at 1000 mm/s^2: 50 ms, whether the program or the search for home had moved it.
TEST(SimulatedJoint, AQuickStopTakesTheTimeOfItsRamp) {
  Bench moved;
  double q = moved.joint.measured();
  for (int k = 0; k < 500; ++k) moved.joint.step(q += 0.05);
  moved.joint.quick_stop();
  EXPECT_NEAR(moved.periods_in(DriveState::kQuickStop), 50, 2);
  EXPECT_EQ(moved.joint.state(), DriveState::kOff);

  Bench searching;
  searching.joint.home();
  for (int k = 0; k < 200; ++k) searching.joint.step(0);
  ASSERT_EQ(searching.joint.state(), DriveState::kHoming);
  searching.joint.quick_stop();
  EXPECT_NEAR(searching.periods_in(DriveState::kQuickStop), 50, 2);
  EXPECT_EQ(searching.joint.state(), DriveState::kOff);
  EXPECT_FALSE(searching.joint.homed());
}

TEST(SimulatedJoint, AQuickStopLeavesAFaultAsItIs) {
  Bench bench;
  bench.joint.fail(Fault::kDriveFault);
  bench.joint.quick_stop();
  for (int k = 0; k < 200; ++k) bench.joint.step(0);
  EXPECT_EQ(bench.joint.state(), DriveState::kFault);
  EXPECT_EQ(bench.joint.fault(), Fault::kDriveFault);
  bench.joint.reset();
  EXPECT_EQ(bench.joint.state(), DriveState::kOff);
  EXPECT_EQ(bench.joint.fault(), Fault::kOk);
}

TEST(SimulatedJoint, AQuickStopEndsItsStartUp) {
  SimulatedJoint joint(config());
  joint.enable();
  joint.step(0);
  ASSERT_EQ(joint.state(), DriveState::kStarting);
  joint.quick_stop();
  EXPECT_EQ(joint.state(), DriveState::kOff);
  joint.quick_stop();
  EXPECT_EQ(joint.state(), DriveState::kOff);
}

// Down to the switch, back off it and up to the index: from then on the encoder reads true places.
TEST(SimulatedJoint, AfterHomingTheEncoderReadsTruePlaces) {
  Bench bench;
  EXPECT_NEAR(bench.joint.measured(), 0, 1e-9) << "it stood at 30 when it was switched on";
  bench.joint.home();
  const int periods = bench.periods_in(DriveState::kHoming);
  ASSERT_EQ(bench.joint.state(), DriveState::kEnabled);
  EXPECT_TRUE(bench.joint.homed());
  EXPECT_GT(bench.joint.measured(), 11) << "past the index";
  EXPECT_GT(periods, 20 / 50.0 / kPeriod_s) << "no faster than 50 mm/s";
  double q = bench.joint.measured();
  while (!bench.joint.on_limit_switch() && q < 120) bench.joint.step(q += 0.02);
  EXPECT_NEAR(bench.joint.measured(), 100, 0.05) << "where the switch is";
  for (int k = 0; k < 100; ++k) bench.joint.step(q -= 0.05);
  bench.joint.reset();
  bench.joint.enable();
  for (int k = 0; k < 10; ++k) bench.joint.step(bench.joint.measured());
  ASSERT_EQ(bench.joint.state(), DriveState::kEnabled);
  bench.joint.set_home_switch_dead(true);
  bench.joint.home();
  bench.periods_in(DriveState::kHoming, 20000);
  EXPECT_EQ(bench.joint.fault(), Fault::kHomingFailed) << "no switch was found";
}

TEST(SimulatedJoint, AStuckAxisLagsUntilItIsAFault) {
  Bench bench;
  bench.joint.set_stuck(true);
  double q = bench.joint.measured();
  int periods = 0;
  for (; bench.joint.state() == DriveState::kEnabled && periods < 1000; ++periods)
    bench.joint.step(q += 0.02);
  EXPECT_EQ(bench.joint.fault(), Fault::kFollowingError);
  EXPECT_NEAR(periods, 2 / 0.02, 3) << "2 mm behind";
}

TEST(SimulatedJoint, ALostDriveIsToldAsLost) {
  Bench bench;
  bench.joint.set_lost(true);
  EXPECT_EQ(bench.joint.state(), DriveState::kLost);
  EXPECT_EQ(bench.joint.fault(), Fault::kDriveLost);
  bench.joint.set_lost(false);
  EXPECT_NE(bench.joint.state(), DriveState::kLost);
}

}  // namespace
}  // namespace trn
