#include "interp/plan/lanes.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

TEST(Lanes, GroupsHoldAllSamples) {
  for (size_t count = 1; count < 20; ++count) {
    EXPECT_GE(lane_groups(count) * kLanes, count);
    EXPECT_LT((lane_groups(count) - 1) * kLanes, count);
  }
}

TEST(Lanes, RaiseKeepsTheGreaterOfEachLaneAndLargestFindsIt) {
  Lanes to{1, -2, 3, -4};
  raise(to, Lanes{0, -1, 5, -5});
  EXPECT_EQ(to[0], 1);
  EXPECT_EQ(to[1], -1);
  EXPECT_EQ(to[2], 5);
  EXPECT_EQ(to[3], -4);
  EXPECT_EQ(largest(to), 5);
  for (size_t lane = 0; lane < kLanes; ++lane) {
    Lanes one{-3, -3, -3, -3};
    one[lane] = -1;
    EXPECT_EQ(largest(one), -1) << lane;
  }
}

}  // namespace
}  // namespace trn
