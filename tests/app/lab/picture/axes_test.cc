#include "app/lab/picture/axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace trn::picture {
namespace {

TEST(RoundUp, GivesOneTwoOrFiveTimesAPowerOfTen) {
  EXPECT_DOUBLE_EQ(round_up(1), 1);
  EXPECT_DOUBLE_EQ(round_up(1.01), 2);
  EXPECT_DOUBLE_EQ(round_up(0.0021), 0.005);
  EXPECT_DOUBLE_EQ(round_up(5100), 10000);
  EXPECT_DOUBLE_EQ(round_up(0.1 + 0.2 - 0.1), 0.2) << "rounding is no reason for the next one";
  for (const double none :
       {0.0, -3.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(round_up(none), 1);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> decade(-12, 12);
  for (int i = 0; i < 1000; ++i) {
    const double least = std::pow(10, decade(random)), step = round_up(least);
    EXPECT_GE(step, least * (1 - 1e-9));
    EXPECT_LE(step, least * 2.5 * (1 + 1e-9));
  }
}

TEST(Ticks, AreMultiplesOfOneRoundStepInTheRange) {
  EXPECT_EQ(ticks({-0.3, 1.1}, 3), (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(ticks({0, 20}, 10).size(), 11u);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-1000, 1000), width(0.001, 500);
  for (int i = 0; i < 500; ++i) {
    const double low = place(random);
    const Range range{low, low + width(random)};
    const auto all = ticks(range, 6);
    ASSERT_GE(all.size(), 2u);
    ASSERT_LE(all.size(), 7u);
    for (const double tick : all) {
      EXPECT_GE(tick, range.low - 1e-9);
      EXPECT_LE(tick, range.high + 1e-9);
    }
  }
}

TEST(Ticks, AreWrittenWithoutTheirRounding) {
  EXPECT_EQ(tick_text(3 * 0.1), "0.3");
  EXPECT_EQ(tick_text(-0.0), "0");
  EXPECT_EQ(tick_text(200000), "200000");
}

TEST(Range, HoldsTheValuesAndIsNeverEmpty) {
  const Range range = Range::over({3, -1, std::numeric_limits<double>::quiet_NaN(), 1}, 0.25);
  EXPECT_DOUBLE_EQ(range.low, -2);
  EXPECT_DOUBLE_EQ(range.high, 4);
  for (const std::vector<double>& values :
       {std::vector<double>{}, {7.0}, {1e12, 1e12}, {std::numeric_limits<double>::quiet_NaN()}})
    EXPECT_GT(Range::over(values).high, Range::over(values).low);
}

TEST(Axes, PutCornersOfTheRangeIntoCornersOfTheBox) {
  const Axes axes({10, 20, 100, 50}, {-1, 1}, {0, 5});
  EXPECT_DOUBLE_EQ(axes.at(-1, 0).x, 10);
  EXPECT_DOUBLE_EQ(axes.at(-1, 0).y, 70) << "y grows upwards in the diagram";
  EXPECT_DOUBLE_EQ(axes.at(1, 5).x, 110);
  EXPECT_DOUBLE_EQ(axes.at(1, 5).y, 20);
}

TEST(Axes, MadeSquareHaveOneScale) {
  Axes axes({0, 0, 200, 100}, {0, 10}, {0, 10});
  axes.make_square();
  EXPECT_DOUBLE_EQ(axes.at(6, 0).x - axes.at(5, 0).x, axes.at(0, 5).y - axes.at(0, 6).y);
  EXPECT_DOUBLE_EQ(axes.at(5, 5).x, 100) << "about the same middle";
  EXPECT_DOUBLE_EQ(axes.at(5, 5).y, 50);
}

/// Places of all numbers below an axis of this range.
std::vector<std::pair<double, std::string>> numbers_below(const Range& x, double width) {
  Svg svg(width + 100, 200);
  Axes({50, 50, width, 100}, x, {0, 1}).draw(svg, "x, mm", "");
  const std::string text = svg.str();
  std::vector<std::pair<double, std::string>> out;
  for (std::size_t at = text.find("y='167.0' text-anchor='middle'"); at != std::string::npos;
       at = text.find("y='167.0' text-anchor='middle'", at + 1)) {
    const std::size_t from = text.rfind("x='", at) + 3, begin = text.find('>', at) + 1;
    out.emplace_back(std::stod(text.substr(from)), text.substr(begin, text.find('<', begin) - begin));
  }
  return out;
}

TEST(Axes, NumbersDoNotTouch) {
  for (const Range& x : {Range{0, 20}, {-466, 466}, {0, 1e6}, {0.0001, 0.00013}, {-123456, 100}})
    for (const double width : {150.0, 230.0, 900.0}) {
      const auto numbers = numbers_below(x, width);
      ASSERT_GE(numbers.size(), 1u);
      for (std::size_t i = 1; i < numbers.size(); ++i) {
        const double room =
            (text_width_px(numbers[i - 1].second, 12) + text_width_px(numbers[i].second, 12)) / 2;
        EXPECT_GT(numbers[i].first - numbers[i - 1].first, room) << numbers[i].second << " of " << width;
      }
    }
}

TEST(Legend, BeginsANewRowWhereTheEntriesDoNotFit) {
  Svg svg(300, 100);
  const std::vector<LegendEntry> entries(6, {"twelve chars", line_colour(0)});
  EXPECT_EQ(draw_legend(svg, 10, 20, 290, {entries[0]}), 40);
  EXPECT_EQ(draw_legend(svg, 10, 20, 290, entries), 80) << "two in a row";
  EXPECT_EQ(svg.str().find("bold"), std::string::npos) << "headings are bold, and nothing else";
}

}  // namespace
}  // namespace trn::picture
