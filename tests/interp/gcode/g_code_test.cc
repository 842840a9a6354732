#include "interp/gcode/g_code.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace trn {
namespace {

TEST(GCode, IsWrittenAsInAProgram) {
  static_assert(tenths(38.2_g) == 382 && tenths(1_g) == 10 && tenths(0_g) == 0 && tenths(183_g) == 1830);
  static_assert(g_from_tenths(591) == 59.1_g && 59.1_g != 591_g);
  static_assert(4.1_g == g_from_tenths(41) && 999.9_g == g_from_tenths(9999));
  static_assert(!std::is_convertible_v<int, GCode> && !std::is_convertible_v<GCode, int>);
}

TEST(GCode, CodesAreInTheOrderOfTheirNumbersAndNoneIsBelowAll) {
  EXPECT_LT(kNoGCode, 0_g);
  EXPECT_LT(33_g, 33.1_g);
  EXPECT_LT(38.5_g, 73_g);
}

TEST(GCode, NamesShowTheDecimalOnlyWhereThereIsOne) {
  EXPECT_EQ(g_name(38.2_g), "G38.2");
  EXPECT_EQ(g_name(1_g), "G1");
  EXPECT_EQ(g_name(0_g), "G0");
  EXPECT_EQ(g_name(g_from_tenths(99999)), "G9999.9");
}

}  // namespace
}  // namespace trn
