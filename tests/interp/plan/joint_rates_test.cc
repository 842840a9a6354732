#include "interp/plan/speed/joint_rates.h"

#include <gtest/gtest.h>

#include "core/axes.h"

namespace trn::speed {
namespace {

TEST(JointRates, AreTheLimitsWithTheirSharesAndTheInversesOfThose) {
  Joint slide, table;
  slide.limit.velocity = 500;
  slide.limit.acceleration = 4000;
  slide.limit.jerk = 50000;
  table.limit.velocity = 2;
  table.limit.acceleration = 10;
  table.limit.jerk = 80;
  const JointRates rates = joint_rates({slide, table}, 0.5, 0.25);
  ASSERT_EQ(rates.count, 2);
  EXPECT_EQ(rates.velocity[0], 500) << "of the speed nothing is kept back";
  EXPECT_EQ(rates.acceleration[0], 2000);
  EXPECT_EQ(rates.jerk[0], 12500);
  EXPECT_EQ(rates.velocity[1], 2);
  EXPECT_EQ(rates.acceleration[1], 5);
  EXPECT_EQ(rates.jerk[1], 20);
  EXPECT_DOUBLE_EQ(rates.velocity_inverse[0], 0.002);
  EXPECT_DOUBLE_EQ(rates.acceleration_inverse[1], 0.2);
  EXPECT_DOUBLE_EQ(rates.jerk_inverse[1], 0.05);
}

}  // namespace
}  // namespace trn::speed
