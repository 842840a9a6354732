#include "hal/can/cia402_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

// Words of CiA 402-2, 8.4: statuswords of the states, controlwords that lead on.
namespace trn {
namespace {

constexpr std::uint16_t kFaultWord = 0x0208, kDisabledWord = 0x0240, kReadyWord = 0x0221, kOnWord = 0x0223,
                        kEnabledWord = 0x0227, kBrakesWord = 0x0207;

class Cia402AxisTest : public testing::Test {
 protected:
  Cia402AxisTest() {
    config.counts_per_unit = 1000;
    config.enable_periods_max = 20;
    axis = std::make_unique<Cia402Axis>(config);
  }
  std::uint16_t step(std::uint16_t status, std::int32_t position = 0, double q = 0, bool follow = false) {
    axis->step({status, position, 8, true}, q, 0, follow, output);
    return output.controlword;
  }
  void enable() {
    axis->enable();
    for (const std::uint16_t word : {kDisabledWord, kReadyWord, kOnWord, kEnabledWord, kEnabledWord})
      step(word);
    ASSERT_EQ(axis->state(), DriveState::kEnabled);
  }
  Cia402Axis::Config config;
  Cia402Axis::Output output;
  std::unique_ptr<Cia402Axis> axis;
};

TEST_F(Cia402AxisTest, EveryStateIsAnsweredWithTheWordThatLeadsOn) {
  EXPECT_EQ(step(kDisabledWord), 0x00) << "not told to be enabled";
  axis->enable();
  EXPECT_EQ(step(kDisabledWord), 0x06);
  EXPECT_EQ(step(kReadyWord), 0x07);
  EXPECT_EQ(step(kOnWord), 0x0F);
  EXPECT_EQ(axis->state(), DriveState::kStarting);
  EXPECT_EQ(step(kEnabledWord), 0x0F);
  EXPECT_EQ(axis->state(), DriveState::kEnabled);
  EXPECT_EQ(output.mode, 8);
}

// 8.4.1: a rising edge of bit 7 resets; every other bit stays 0.
TEST_F(Cia402AxisTest, AResetIsEdgesOfBitSevenUntilTheDriveObeys) {
  EXPECT_EQ(step(kFaultWord), 0x00);
  EXPECT_EQ(axis->fault(), Fault::kDriveFault);
  axis->reset();
  for (const int word : {0x80, 0x00, 0x80, 0x00}) {
    EXPECT_EQ(step(kFaultWord), word);
    EXPECT_EQ(axis->state(), DriveState::kStarting);
  }
  EXPECT_EQ(step(kDisabledWord), 0x00);
  EXPECT_EQ(axis->fault(), Fault::kOk);
  step(kFaultWord);
  EXPECT_EQ(axis->fault(), Fault::kDriveFault) << "a new one";
}

TEST_F(Cia402AxisTest, AResetThatTheDriveDoesNotObeyEnds) {
  step(kFaultWord);
  axis->reset();
  for (int i = 0; i < 20; ++i) step(kFaultWord);
  EXPECT_EQ(axis->fault(), Fault::kOk);
  EXPECT_EQ(step(kFaultWord), 0x00);
  EXPECT_EQ(axis->fault(), Fault::kDriveFault);
  EXPECT_EQ(axis->state(), DriveState::kFault);
}

TEST_F(Cia402AxisTest, ADriveThatStaysOnItsWayIsLate) {
  axis->enable();
  for (int i = 0; i < 20; ++i) step(kReadyWord);
  EXPECT_EQ(axis->fault(), Fault::kOk);
  step(kReadyWord);
  EXPECT_EQ(axis->fault(), Fault::kDriveNotReady);
}

// A drive that never goes into the homing mode, and one that homes for ever: each has the whole time, and no
// more. The time begins again when the mode is reached.
TEST_F(Cia402AxisTest, HomingThatNeverBeginsOrNeverEndsIsLate) {
  config.homing_periods_max = 30;
  for (const int in_mode_from : {1000, 10}) {
    axis = std::make_unique<Cia402Axis>(config);
    enable();
    axis->home();
    const int last = in_mode_from > 30 ? 30 : in_mode_from + 30;
    for (int period = 1; period <= last + 1; ++period) {
      EXPECT_EQ(axis->fault(), Fault::kOk) << "period " << period;
      const std::int8_t mode = period >= in_mode_from ? 6 : 8;
      axis->step({kEnabledWord, 0, mode, true}, 0, 0, false, output);
    }
    EXPECT_EQ(axis->fault(), Fault::kHomingFailed);
  }
}

TEST_F(Cia402AxisTest, AQuickStopIsCommandedWhileThereIsPower) {
  enable();
  axis->quick_stop();
  EXPECT_EQ(step(kEnabledWord), 0x02);
  EXPECT_EQ(step(0x0207), 0x02) << "quick stop active";
  EXPECT_EQ(axis->state(), DriveState::kQuickStop);
  EXPECT_EQ(step(kDisabledWord), 0x00);
  EXPECT_EQ(axis->state(), DriveState::kOff);
}

// A reset right behind an emergency stop: the drive still looks enabled, then it brakes.
TEST_F(Cia402AxisTest, WhoIsEnabledWhileItStopsComesUpBehindTheStop) {
  enable();
  axis->quick_stop();
  axis->enable();
  for (int position = 0; position < 500; position += 100) {
    EXPECT_EQ(step(position < 200 ? kEnabledWord : kBrakesWord, position), 0x02) << "it keeps its torque";
    EXPECT_EQ(axis->state(), DriveState::kStarting);
    EXPECT_FALSE(axis->wanted());
    axis->enable();
  }
  EXPECT_EQ(step(kDisabledWord), 0x06);
  for (const std::uint16_t word : {kReadyWord, kOnWord, kEnabledWord}) step(word);
  EXPECT_EQ(axis->state(), DriveState::kEnabled);
  EXPECT_EQ(axis->fault(), Fault::kOk);
}

TEST_F(Cia402AxisTest, AStopOrASwitchOffTakesTheNextEnableBack) {
  enable();
  axis->quick_stop();
  axis->enable();
  axis->quick_stop();
  step(kBrakesWord);
  EXPECT_EQ(axis->state(), DriveState::kQuickStop);
  EXPECT_EQ(step(kDisabledWord), 0x00);
  EXPECT_EQ(axis->state(), DriveState::kOff);
  enable();
  axis->quick_stop();
  axis->enable();
  axis->disable();
  EXPECT_EQ(step(kBrakesWord), 0x00);
  EXPECT_EQ(axis->state(), DriveState::kOff);
  enable();
  axis->quick_stop();
  axis->enable();
  step(kFaultWord);
  EXPECT_EQ(step(kDisabledWord), 0x00) << "a fault on the way";
}

// 0x605A = 5 and 6: the drive stays in Quick Stop Active.
TEST_F(Cia402AxisTest, ADriveThatStaysInQuickStopActiveIsLedOnWhenItStands) {
  enable();
  axis->quick_stop();
  axis->enable();
  for (int i = 0; i < 9; ++i) EXPECT_EQ(step(kBrakesWord, 100 * (5 - std::min(i, 5))), 0x02) << i;
  int periods = 0;
  while (step(kBrakesWord) == 0x02 && periods < 100) ++periods;
  EXPECT_LT(periods, 10);
  EXPECT_EQ(output.controlword, 0x00) << "Disable Voltage leads out of it";
  EXPECT_EQ(step(kDisabledWord), 0x06);
}

TEST_F(Cia402AxisTest, ADriveWhoseEncoderNeverRestsIsLedOnWhenTimeIsUp) {
  enable();
  axis->quick_stop();
  axis->enable();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(step(kBrakesWord, 100 * (i % 2)), 0x02) << i;
  EXPECT_EQ(step(kBrakesWord), 0x00);
}

TEST_F(Cia402AxisTest, BehindABrakeTheStopEndsWhenTheBrakeHolds) {
  config.braked = true;
  axis = std::make_unique<Cia402Axis>(config);
  enable();
  axis->quick_stop();
  axis->enable();
  for (int i = 0; i < 100; ++i) EXPECT_EQ(step(kBrakesWord), 0x02) << i;
  EXPECT_TRUE(axis->stopping());
  axis->end_stop();
  EXPECT_EQ(step(kBrakesWord), 0x00);
  EXPECT_EQ(step(kDisabledWord), 0x06);
}

TEST_F(Cia402AxisTest, ItHoldsWhereItStoodAndFollowsToTheCount) {
  axis->enable();
  for (const std::uint16_t word : {kDisabledWord, kReadyWord, kOnWord, kEnabledWord}) step(word, 5000);
  EXPECT_EQ(output.position, 5000);
  step(kEnabledWord, 5003);
  EXPECT_EQ(output.position, 5000) << "a drive that is pushed away goes back";
  step(kEnabledWord, 5003, 5.0124, true);
  EXPECT_EQ(output.position, 5012);
  EXPECT_DOUBLE_EQ(axis->measured(), 5.003);
}

TEST_F(Cia402AxisTest, TheFollowingErrorIsToTheSetpointTwoPeriodsBefore) {
  config.following_error_max = 0.1;
  axis = std::make_unique<Cia402Axis>(config);
  enable();
  // 0.3 mm a period: measured two periods behind is right, one less is 0.3 mm off
  for (int i = 0; i < 10; ++i) {
    const int behind = i < 2 ? 0 : 300 * (i - 2);
    step(kEnabledWord, behind, 0.3 * i, true);
    ASSERT_EQ(axis->fault(), Fault::kOk) << i;
  }
  step(kEnabledWord, 300 * 8 + 101, 3.0, true);
  EXPECT_EQ(axis->fault(), Fault::kFollowingError);
}

TEST_F(Cia402AxisTest, ItStandsWhereTheEncoderStaysWithinACount) {
  for (int i = 0; i < 10; ++i) {
    step(kDisabledWord, 5000 + i % 2);
    EXPECT_FALSE(axis->stands()) << i;
  }
  step(kDisabledWord, 5001);
  EXPECT_TRUE(axis->stands());
  step(kDisabledWord, 5003);
  EXPECT_FALSE(axis->stands()) << "two counts in a period";
}

TEST_F(Cia402AxisTest, WhatNoDriveCanDoInAPeriodIsNoMeasurement) {
  config.step_max = 0.05;  // mm, 50 counts
  axis = std::make_unique<Cia402Axis>(config);
  enable();
  step(kEnabledWord, 50, 0, true);
  EXPECT_DOUBLE_EQ(axis->measured(), 0.05);
  step(kEnabledWord, 101, 0, true);
  EXPECT_DOUBLE_EQ(axis->measured(), 0.05) << "51 counts";
  step(kEnabledWord, 60, 0, true);
  EXPECT_DOUBLE_EQ(axis->measured(), 0.06);
  for (int i = 0; i < 3; ++i) step(kEnabledWord, 500, 0, true);
  EXPECT_EQ(axis->fault(), Fault::kOk);
  EXPECT_DOUBLE_EQ(axis->measured(), 0.06);
  step(kEnabledWord, 500, 0, true);
  EXPECT_EQ(axis->fault(), Fault::kFollowingError) << "it really is there";
}

}  // namespace
}  // namespace trn
