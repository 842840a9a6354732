#include "interp/gcode/text/fixed_decimal.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/rounds.h"

// The fast writer of four decimals beside fmt: the same digits, or none at all.
namespace trn {
namespace {

bool written(double value, std::string& text) {
  char buffer[kFourDecimalsMax];
  const char* const end = write_four_decimals(buffer, value);
  if (end) text = std::string(static_cast<const char*>(buffer), end);
  return end != nullptr;
}

void compare(double value) {
  std::string text;
  if (!written(value, text)) return;
  ASSERT_EQ(text, fmt::format("{:.4f}", value)) << fmt::format("{:a}", value);
}

TEST(FixedDecimal, UsualNumbersAreWritten) {
  for (const double value :
       {0.0, -0.0, 1.0, -1.0, 0.0001, 99.9999, 12345.6789, -0.00001, 25.4, 1e10, 99999999999.0}) {
    std::string text;
    ASSERT_TRUE(written(value, text)) << value;
    EXPECT_EQ(text, fmt::format("{:.4f}", value));
  }
}

TEST(FixedDecimal, WhatItCannotDoIsLeftToFmt) {
  std::string text;
  for (const double value :
       {1e11, -1e300, std::numeric_limits<double>::infinity(), std::nan(""), 0.03125, -2.40625})
    EXPECT_FALSE(written(value, text)) << value;
}

TEST(FixedDecimal, DigitsAreThoseOfFmt) {
  const int most = 20'000 * test::rounds(10);
  std::mt19937_64 rng(20);
  for (int i = 0; i < most; ++i) {
    compare(std::bit_cast<double>(rng()));  // any bits
    const double size = std::ldexp(1, static_cast<int>(rng() % 40) - 5);
    const double value = size * (static_cast<double>(rng() >> 11) * 0x1p-53 - 0.5);
    compare(value);
    // five decimals that end in 5, and their neighbours: where one rounding of a product is not enough
    const double half = (std::floor(value * 1e4) + 0.5) / 1e4;
    compare(half);
    compare(std::nextafter(half, 1e30));
    compare(std::nextafter(half, -1e30));
    compare(std::floor(value * 1e4) / 1e4);
  }
}

}  // namespace
}  // namespace trn
