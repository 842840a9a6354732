#include "interp/gcode/axis_words.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace trn {
namespace {

const ProgramWords kPlace{{1, -2, 4}, {90, 0, -45}};

TEST(AxisWords, UnitsDoNotMix) {
  static_assert(!std::is_convertible_v<ProgramWords, MmWords> &&
                !std::is_convertible_v<MmWords, ProgramWords>);
  static_assert(!std::is_convertible_v<ProgramWords, Words> && !std::is_convertible_v<Words, ProgramWords>);
  static_assert(!std::is_convertible_v<MmWords, Words> && !std::is_convertible_v<Words, MmWords>);
  static_assert(!std::is_convertible_v<TableWords, MmWords> &&
                !std::is_convertible_v<TableWords, ProgramWords>);
}

TEST(AxisWords, InchesBecomeMillimetresAndAnglesStay) {
  EXPECT_EQ(in_mm(kPlace, true), (MmWords{{25.4, -50.8, 4 * 25.4}, {90, 0, -45}}));
  EXPECT_EQ(in_mm(kPlace, false), (MmWords{{1, -2, 4}, {90, 0, -45}}));
  EXPECT_EQ(in_program_units(in_mm(kPlace, true), true), kPlace);
  EXPECT_EQ(in_program_units(in_mm(kPlace, false), false), kPlace);
}

TEST(AxisWords, TablesHaveAUnitOfTheirOwn) {
  const MmWords words = in_mm(TableWords{{1, 2, 4}, {4, 5, 6}}, 25.4);
  EXPECT_EQ(words, (MmWords{{25.4, 50.8, 4 * 25.4}, {4, 5, 6}}));
  EXPECT_EQ(in_table_units(words, 25.4), (TableWords{{1, 2, 4}, {4, 5, 6}}));
}

TEST(AxisWords, OnlyAnglesChangeBetweenDegreesAndRadians) {
  const Words words = in_radians(in_mm(kPlace, false));
  EXPECT_EQ(words[kY], -2);
  EXPECT_DOUBLE_EQ(words[kA], kPi / 2);
  EXPECT_DOUBLE_EQ(words[kC], -kPi / 4);
  const MmWords back = in_degrees<MmWords>(words);
  EXPECT_EQ(back.xyz, kPlace.xyz);
  EXPECT_NEAR((back.abc_deg - kPlace.abc_deg).norm(), 0, 1e-12);
}

TEST(AxisWords, TheAxisIndexReachesLengthsAndAngles) {
  MmWords words;
  EXPECT_TRUE(words.is_zero());
  words[kZ] = 7;
  words[kB] = -8;
  EXPECT_EQ(words, (MmWords{{0, 0, 7}, {0, -8, 0}}));
  EXPECT_FALSE(words.is_zero());
  EXPECT_EQ(words - words, MmWords{});
  EXPECT_EQ(words + words, (MmWords{{0, 0, 14}, {0, -16, 0}}));
}

}  // namespace
}  // namespace trn
