#include "hal/can/brake.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

Brake::Config config() {
  Brake::Config out;
  out.fitted = true;
  out.release_periods = 5;
  out.close_periods = 3;
  out.stop_periods_max = 20;
  return out;
}
constexpr Brake::Input kHeld{true, true, true}, kOff{false, true, false};

int periods_until_open(Brake& brake) {
  int periods = 0;
  for (; !brake.open() && periods < 100; ++periods) brake.step(kHeld);
  return periods;
}

TEST(Brake, LetsGoWhenTheDriveHoldsAndNotBefore) {
  Brake brake(config());
  for (int i = 0; i < 10; ++i) brake.step(kOff);
  EXPECT_FALSE(brake.output());
  EXPECT_TRUE(brake.holds());
  brake.step(kHeld);
  EXPECT_TRUE(brake.output());
  EXPECT_FALSE(brake.open()) << "the brake takes its time";
  EXPECT_FALSE(brake.holds());
  EXPECT_EQ(periods_until_open(brake), 5);
}

TEST(Brake, HoldsBeforeTheDriveLetsGo) {
  Brake brake(config());
  periods_until_open(brake);
  brake.step({true, false, false});
  EXPECT_TRUE(brake.open()) << "it still moves";
  brake.step({true, true, false});
  EXPECT_FALSE(brake.output());
  EXPECT_FALSE(brake.holds());
  for (int i = 0; i < 3; ++i) brake.step({true, true, false});
  EXPECT_TRUE(brake.holds());
}

TEST(Brake, ClosesAtOnceWhenNobodyHolds) {
  Brake brake(config());
  periods_until_open(brake);
  brake.step({false, false, true});
  EXPECT_FALSE(brake.output());
}

TEST(Brake, ClosesThoughTheEncoderNeverStands) {
  Brake brake(config());
  periods_until_open(brake);
  int periods = 0;
  for (; brake.output() && periods < 100; ++periods) brake.step({true, false, false});
  EXPECT_EQ(periods, 21);
}

TEST(Brake, MayBeReleasedByAnOutputThatGoesOff) {
  Brake::Config other = config();
  other.inverted = true;
  Brake brake(other);
  EXPECT_TRUE(brake.output());
  periods_until_open(brake);
  EXPECT_FALSE(brake.output());
}

TEST(Brake, OneThatIsNotThereIsNeverInTheWay) {
  const Brake brake{Brake::Config{}};
  EXPECT_TRUE(brake.open());
  EXPECT_TRUE(brake.holds());
}

}  // namespace
}  // namespace trn
