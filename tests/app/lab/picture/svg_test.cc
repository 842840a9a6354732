#include "app/lab/picture/svg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "app/lab/picture/polar_axes.h"
#include "app/lab/picture/svg_chart.h"
#include "core/units.h"

namespace trn::picture {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t out = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++out;
  return out;
}

TEST(Thinned, KeepsEveryPeak) {
  std::vector<Px> points;
  for (int i = 0; i < 100000; ++i) points.push_back({i * 0.01, 50});
  points[33333].y = 10;
  points[66666].y = 90;
  const auto few = thinned(points, 1000);
  EXPECT_LE(few.size(), 1000u);
  EXPECT_GE(few.size(), 400u);
  double low = 50, high = 50, before = -1;
  for (const Px& p : few) {
    low = std::min(low, p.y);
    high = std::max(high, p.y);
    EXPECT_GT(p.x, before) << "in their order";
    before = p.x;
  }
  EXPECT_EQ(low, 10);
  EXPECT_EQ(high, 90);
}

TEST(Thinned, KeepsGapsAndShortLines) {
  const std::vector<Px> three{{0, 1}, {1, kGap}, {2, 3}};
  EXPECT_EQ(thinned(three, 3).size(), 3u);
  std::vector<Px> points;
  for (int i = 0; i < 10000; ++i) points.push_back({i * 1.0, i == 5000 ? kGap : 1.0});
  std::size_t gaps = 0;
  for (const Px& p : thinned(points, 100)) gaps += std::isnan(p.y);
  EXPECT_EQ(gaps, 1u);
}

TEST(Svg, BreaksALineAtAGap) {
  Svg svg(100, 100);
  svg.polyline({{0, 0}, {1, 1}, {2, kGap}, {3, 3}, {4, kGap}, {5, kGap}}, "black");
  EXPECT_EQ(count(svg.str(), "<polyline"), 2u);
  EXPECT_EQ(svg.str().find("nan"), std::string::npos);
}

TEST(Svg, EscapesTextAndLetsItFit) {
  Svg svg(100, 100);
  svg.text(0, 10, "a<b & c", {"start", 20, false, 42});
  EXPECT_NE(svg.str().find(">a&lt;b &amp; c<"), std::string::npos);
  EXPECT_NE(svg.str().find("font-size='10'"), std::string::npos) << "7 letters of 0.6 * 20 px are 84 px";
  EXPECT_DOUBLE_EQ(text_width_px("µm²", 10), 18) << "letters, not bytes";
}

TEST(Svg, IsWholeByItself) {
  Svg svg(120, 80);
  svg.line({0, 0}, {1, 1}, kGrid);
  svg.circle({5, 5}, 2, kInk);
  const std::string text = svg.str();
  EXPECT_EQ(text.substr(0, 4), "<svg");
  EXPECT_NE(text.find("viewBox='0 0 120 80'"), std::string::npos);
  EXPECT_EQ(text.substr(text.size() - 7), "</svg>\n");
  for (const char* elsewhere : {"href=", "src=", "url("}) EXPECT_EQ(text.find(elsewhere), std::string::npos);
}

TEST(PolarAxes, HoldTheLargestDeviationAndTellTheirScale) {
  for (const double peak : {0.004, 0.7, 11.0, 430.0}) {
    const PolarAxes axes({300, 300}, peak);
    EXPECT_GE(PolarAxes::kRings * axes.per_ring(), peak * (1 - 1e-9));
    EXPECT_LT(PolarAxes::kRings * axes.per_ring(), 2.6 * peak);
    const Px nominal = axes.at(0, 0), outside = axes.at(0, peak), up = axes.at(kPi / 2, 0);
    EXPECT_GT(outside.x, nominal.x);
    EXPECT_LT(outside.x, 300 + PolarAxes::reach_px());
    EXPECT_LT(up.y, 300) << "counterclockwise";
    EXPECT_NEAR(up.x, 300, 1e-9);
  }
}

TEST(SvgChart, HasALineALegendAndUnits) {
  SvgChart chart("Force", "time, s", "force, N");
  chart.add("estimated", {0, 1, 2, 3}, {0, 1, kGap, 2});
  chart.add("true", {0, 1}, {1, 1});
  for (const bool square : {false, true}) {
    if (square) chart.set_square();
    const std::string text = chart.str();
    EXPECT_EQ(count(text, "<polyline"), 3u);
    for (const char* words : {">Force<", ">time, s<", ">force, N<", ">estimated<", ">true<"})
      EXPECT_EQ(count(text, words), 1u) << words;
    EXPECT_EQ(text.find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace trn::picture
