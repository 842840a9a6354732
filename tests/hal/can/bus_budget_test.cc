#include "hal/can/bus_budget.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

// A frame of 7 bytes takes 8 * 7 + 47 + (34 + 56 - 1) / 4 = 125 bits, the longest in the way 135.
TEST(BusBudget, WhatGoesEveryPeriodGoesMoreRarelyInALongerOne) {
  const BusBudget budget{"can0", 1e6, 0.001, {{"setpoints", 12, 7, 0.001}}};
  EXPECT_NEAR(budget.needed_s(), 1635e-6, 1e-12);
  EXPECT_DOUBLE_EQ(budget.smallest_period_s(), 0.002);
}

TEST(BusBudget, WhatHasItsOwnCycleKeepsIt) {
  // 12 frames every period are 1500 us; a heartbeat frame every 50 ms 40 * 135 us / 50 ms = 10.8 % of the bus
  const BusBudget budget{"can0", 1e6, 0.001, {{"setpoints", 12, 7, 0.001}, {"heartbeats", 40, 8, 0.05}}};
  EXPECT_NEAR(budget.cyclic_s(), 1608e-6, 1e-12);
  EXPECT_DOUBLE_EQ(budget.smallest_period_s(), 0.002);  // 1500 + 216 + 135 = 1851 us
  const BusBudget more{"can0", 1e6, 0.001, {{"setpoints", 14, 7, 0.001}, {"heartbeats", 40, 8, 0.05}}};
  EXPECT_DOUBLE_EQ(more.smallest_period_s(), 0.003);  // 1750 + 216 + 135 = 2101 us
}

TEST(BusBudget, NoPeriodIsLongEnoughForABusThatIsFull) {
  const BusBudget budget{"can0", 1e6, 0.001, {{"heartbeats", 400, 8, 0.05}}};  // 54 ms of every 50 ms
  EXPECT_EQ(budget.smallest_period_s(), 0);
}

}  // namespace
}  // namespace trn
