#include "interp/gcode/modal.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

// The rows of NIST RS274/NGC table 4 that this dialect shares.
TEST(Modal, CodesThatExcludeEachOtherAreOneGroup) {
  const ModalTable table;
  const auto expect_group = [&](GGroup group, std::initializer_list<GCode> codes) {
    for (const GCode code : codes) EXPECT_EQ(table.g_group(code), static_cast<int>(group)) << g_name(code);
  };
  expect_group(GGroup::kMotion, {0_g, 1_g, 2_g, 3_g, 38.2_g, 80_g, 81_g, 89_g, 183_g});
  expect_group(GGroup::kPlane, {17_g, 18_g, 19_g});
  expect_group(GGroup::kDistance, {90_g, 91_g});
  expect_group(GGroup::kFeedMode, {93_g, 94_g, 95_g});
  expect_group(GGroup::kUnits, {20_g, 21_g});
  expect_group(GGroup::kCutterComp, {40_g, 41_g, 42_g});
  expect_group(GGroup::kRetract, {98_g, 99_g});
  expect_group(GGroup::kNonModal, {4_g, 10_g, 28_g, 53_g, 92_g});
  for (const GCode code : kWorkOffsetCodes) expect_group(GGroup::kWorkOffset, {code});
  for (const int code : {3, 4, 5}) EXPECT_EQ(table.m_group(code), static_cast<int>(MGroup::kSpindle)) << code;
}

TEST(Modal, WhatIsNoCodeHasNoGroupUntilTheConfigGivesItOne) {
  ModalTable table;
  for (const GCode code : {kNoGCode, 1.1_g, 187_g, g_from_tenths(10000)}) EXPECT_EQ(table.g_group(code), -1);
  for (const int code : {-1, 428, 1000}) EXPECT_EQ(table.m_group(code), -1) << code;
  table.map_g(187_g, GGroup::kIgnored);
  table.map_m(428, MGroup::kRtcp);
  EXPECT_EQ(table.g_group(187_g), static_cast<int>(GGroup::kIgnored));
  EXPECT_EQ(table.m_group(428), static_cast<int>(MGroup::kRtcp));
}

}  // namespace
}  // namespace trn
