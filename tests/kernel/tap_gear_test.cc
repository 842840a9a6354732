#include "kernel/tap_gear.h"

#include <gtest/gtest.h>

#include <cmath>

// M6 x 1: 1 mm a turn, 10 turns a second, along -Z.
namespace trn {
namespace {

constexpr double kPeriod = 0.002;

class TapGearTest : public testing::Test {
 protected:
  TapGearTest() {
    gear.begin(3, 10, 1);
    gear.follow_tip(tip);
    gear.spindle_rpm(3);
  }
  /// A period in which the tip goes `mm` down; the rpm that the spindle is told.
  double step(double mm, double turns) {
    tip.z() -= mm;
    gear.follow_tip(tip);
    return gear.spindle_rpm(turns);
  }
  TapGear gear{kPeriod};
  Vec3 tip{5, 6, 10};
};

TEST_F(TapGearTest, TheSpindleIsToldTheSpeedOfThePath) {
  EXPECT_NEAR(step(0.02, 3), 600, 1e-9);       // 0.02 mm in 2 ms: 10 turns a second
  EXPECT_NEAR(step(0.01, 3.02), 300, 1e-9);    // where the path had it
  EXPECT_NEAR(step(-0.01, 3.03), -300, 1e-9);  // and back
}

TEST_F(TapGearTest, ASpindleThatIsBehindIsToldMoreAndNeverTooMuch) {
  step(0.01, 3);
  EXPECT_NEAR(step(0.01, 3.009), 60 * (5 + 60 * 0.001), 1e-9);
  EXPECT_NEAR(step(0.01, 2.5), 720, 1e-9) << "1.2 times the full speed";
  EXPECT_NEAR(step(0.01, 4.5), -720, 1e-9);
}

TEST_F(TapGearTest, PlanTimeWaitsForASpindleThatIsBehind) {
  step(0.02, 3);
  EXPECT_NEAR(gear.rate(3.02), 1, 1e-12);
  EXPECT_NEAR(gear.rate(3.01), 1 - 40 * 0.01 / 10, 1e-12);
  EXPECT_NEAR(gear.rate(3.03), 1 + 40 * 0.01 / 10, 1e-12);
  EXPECT_EQ(gear.rate(2.7), 0);
  EXPECT_NEAR(gear.rate(3.3), 1.2, 1e-12);
  step(-0.02, 3.02);  // on the way back less turns are ahead
  EXPECT_NEAR(gear.rate(2.99), 1 + 40 * 0.01 / 10, 1e-12);
}

TEST_F(TapGearTest, AtStandstillATenthOfTheFullSpeedIsThePace) {
  step(0, 3);
  EXPECT_NEAR(gear.rate(2.99), 1 - 40 * 0.01 / 1, 1e-12);
}

TEST_F(TapGearTest, SettledAndLost) {
  step(0, 3);
  EXPECT_TRUE(gear.settled(3.0009));
  EXPECT_FALSE(gear.settled(2.9989));
  EXPECT_FALSE(gear.lost(3.249));
  EXPECT_TRUE(gear.lost(2.749));
  step(0.001, 3);
  EXPECT_FALSE(gear.settled(3.001)) << "it moves";
  gear.end();
  EXPECT_FALSE(gear.lost(2));
  EXPECT_FALSE(gear.active());
}

TEST(TapGear, ALeftHandTapTurnsTheOtherWay) {
  TapGear gear(kPeriod);
  gear.begin(0, -10, 2);
  gear.follow_tip(Vec3::Zero());
  gear.spindle_rpm(0);
  gear.follow_tip(Vec3(0, 0, -0.02));  // half a turn of 0.02: 0.01 turns
  EXPECT_NEAR(gear.spindle_rpm(0), -300, 1e-9);
  EXPECT_LT(gear.rate(-0.005), 1) << "behind";
  EXPECT_GT(gear.rate(-0.015), 1) << "ahead";
}

}  // namespace
}  // namespace trn
