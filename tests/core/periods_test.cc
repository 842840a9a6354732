#include "core/periods.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace trn {
namespace {

// The last period counts when it has begun; a rounding error begins none.
TEST(Periods, ATimeIsOverInSoManyPeriods) {
  EXPECT_EQ(periods_of(0, 0.001), 0u);
  EXPECT_EQ(periods_of(0.0001, 0.001), 1u);
  EXPECT_EQ(periods_of(0.001, 0.001), 1u);
  EXPECT_EQ(periods_of(0.0011, 0.001), 2u);
  for (std::uint32_t n = 1; n <= 20000; ++n)
    for (const double period_s : {0.00025, 0.0005, 0.001, 0.002, 0.004}) {
      ASSERT_EQ(periods_of(n * period_s, period_s), n) << period_s;
      ASSERT_EQ(periods_of(n / (1 / period_s), period_s), n) << period_s;
    }
}

// People write 1e9 for "never". As a number of 32 bits it would be any time at all.
TEST(Periods, WhatIsLongerThanCanBeCountedIsTheLongest) {
  for (const double never_s : {4294967.296, 1e9, 1e300}) EXPECT_EQ(periods_of(never_s, 0.001), UINT32_MAX);
  EXPECT_EQ(periods_of(4294967, 0.001), 4294967000u);
}

}  // namespace
}  // namespace trn
