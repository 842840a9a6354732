#include "app/daemon/latency.h"

#include <gtest/gtest.h>

#include <vector>

namespace trn {
namespace {

std::vector<PeriodFit> fits(double latest_us, double longest_us) {
  std::vector<PeriodFit> out;
  for (const PeriodVerdict& verdict : judge_periods(latest_us, longest_us)) out.push_back(verdict.fit);
  return out;
}

TEST(Latency, WhatIsTakenIsWakeUpAndTickTogether) {
  using enum PeriodFit;
  EXPECT_EQ(fits(20, 10), (std::vector{kGood, kGood, kGood, kGood, kGood}));
  EXPECT_EQ(fits(100, 25), (std::vector{kGood, kGood, kGood, kGood, kGood})) << "half of it is still good";
  EXPECT_EQ(fits(100, 26), (std::vector{kTight, kGood, kGood, kGood, kGood}));
  EXPECT_EQ(fits(200, 50), (std::vector{kNo, kGood, kGood, kGood, kGood})) << "the next one begins then";
  EXPECT_EQ(fits(1500, 0), (std::vector{kNo, kNo, kNo, kTight, kGood}));
  EXPECT_EQ(fits(5000, 0), (std::vector{kNo, kNo, kNo, kNo, kNo}));
}

TEST(Latency, TheShortestGoodPeriodIsNamed) {
  EXPECT_EQ(shortest_good_us(judge_periods(20, 10)), 250);
  EXPECT_EQ(shortest_good_us(judge_periods(1500, 0)), 4000);
  EXPECT_EQ(shortest_good_us(judge_periods(9000, 0)), 0);
}

}  // namespace
}  // namespace trn
