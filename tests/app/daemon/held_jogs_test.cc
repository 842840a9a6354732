#include "app/daemon/held_jogs.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

using std::chrono::milliseconds;

TEST(HeldJogs, AJointIsSilentWhenItsTimeIsOverAndIsToldOnce) {
  HeldJogs jogs;
  const HeldJogs::Time begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(jogs.take_silent(begin + std::chrono::hours(1))) << "nobody has jogged";
  jogs.hear(1, milliseconds(100), begin);
  jogs.hear(2, milliseconds(50), begin);
  EXPECT_FALSE(jogs.take_silent(begin + milliseconds(49)));
  EXPECT_EQ(jogs.take_silent(begin + milliseconds(50)), 2);
  EXPECT_FALSE(jogs.take_silent(begin + milliseconds(99)));
  jogs.hear(1, milliseconds(100), begin + milliseconds(99));  // still held
  EXPECT_FALSE(jogs.take_silent(begin + milliseconds(198)));
  EXPECT_EQ(jogs.take_silent(begin + milliseconds(199)), 1);
  EXPECT_FALSE(jogs.take_silent(begin + std::chrono::hours(1)));
}

TEST(HeldJogs, AStepOrALetGoNeedsNobodyToHoldIt) {
  HeldJogs jogs;
  const HeldJogs::Time begin = std::chrono::steady_clock::now();
  jogs.hear(0, milliseconds(100), begin);
  jogs.hear(0, milliseconds(0), begin + milliseconds(10));
  EXPECT_FALSE(jogs.take_silent(begin + std::chrono::hours(1)));
}

}  // namespace
}  // namespace trn
