#include "core/check.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

TEST(Check, TheFirstFailureOfAScopeIsNoted) {
  CheckFailure noted;
  {
    const CheckScope scope(noted);
    TRN_CHECK(1 + 1 == 2);
    EXPECT_FALSE(noted);
    TRN_CHECK(1 + 1 == 3);
    TRN_CHECK(1 + 1 == 4);
  }
  ASSERT_TRUE(noted);
  EXPECT_STREQ(noted.condition, "1 + 1 == 3");
  EXPECT_STREQ(noted.file, "check_test.cc");
  EXPECT_EQ(explain(noted),
            "check_test.cc:" + std::to_string(noted.line) + ": the internal check (1 + 1 == 3) failed");
  EXPECT_EQ(explain({}), "");
}

TEST(Check, ScopesNest) {
  CheckFailure outer, inner;
  const CheckScope around(outer);
  {
    const CheckScope scope(inner);
    TRN_CHECK(false);
  }
  EXPECT_TRUE(inner);
  EXPECT_FALSE(outer);
  TRN_CHECK(false);
  EXPECT_TRUE(outer);
}

TEST(CheckDeathTest, WithoutAScopeTheProcessEnds) {
  const int legs = 5;
  EXPECT_DEATH(TRN_CHECK(legs == 6), "check_test.cc:[0-9]+: internal check failed: legs == 6");
}

}  // namespace
}  // namespace trn
