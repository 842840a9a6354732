#include "sim/canopen/emulated_homing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

// Every method from every side of its switch, in both directions of the drive. The truth is read off the
// figures of CiA 402-2, clause 11: which edge of which switch, and on which side of it the index lies.
namespace trn {
namespace {

constexpr double kLimit = 100, kLow = -12.3, kHigh = 7.9, kIndex = 0.37, kPitch = 5;
constexpr double kFar = std::numeric_limits<double>::infinity();

enum class At { kNegativeLimit, kPositiveLimit, kLowEdge, kHighEdge, kNowhere };

struct Figure {
  int method;
  At at;
  int index;  ///< -1: the pulse on the negative side, +1: on the positive side
  int first;  ///< way in which it sets out from beside the switch
};

// Left in the figures is negative. 17 to 30: the edge itself.
const std::vector<Figure> kFigures = {
    {1, At::kNegativeLimit, +1, -1}, {2, At::kPositiveLimit, -1, +1}, {3, At::kLowEdge, -1, +1},
    {4, At::kLowEdge, +1, +1},       {5, At::kHighEdge, +1, -1},      {6, At::kHighEdge, -1, -1},
    {7, At::kLowEdge, -1, +1},       {8, At::kLowEdge, +1, +1},       {9, At::kHighEdge, -1, +1},
    {10, At::kHighEdge, +1, +1},     {11, At::kHighEdge, +1, -1},     {12, At::kHighEdge, -1, -1},
    {13, At::kLowEdge, +1, -1},      {14, At::kLowEdge, -1, -1},      {33, At::kNowhere, -1, -1},
    {34, At::kNowhere, +1, +1},
};

/// Switches as the drive sees them, turned over for a drive that counts the other way.
EmulatedHoming::Switches switches_for(int method, bool reverse) {
  const int like = method >= 17 && method <= 30 ? method - 16 : method;
  double low = kLow, high = kHigh;
  if (like == 3 || like == 4) high = kFar;  // closed up to the positive end
  if (like == 5 || like == 6) low = -kFar;
  EmulatedHoming::Switches out{low, high, -kLimit, kLimit, kIndex, kPitch};
  if (reverse) out = {-high, -low, -kLimit, kLimit, -kIndex, kPitch};
  return out;
}

struct Outcome {
  bool found = false;
  double home = 0, first_way = 0, farthest = 0;
};

/// A carriage of 2000 mm/s^2 that does what it is told, every millisecond; places as the drive counts.
Outcome home(int method, bool reverse, double start, double fast = 20, bool dead = false) {
  const double sign = reverse ? -1 : 1;
  EmulatedHoming homing;
  double place = sign * start, speed = 0;
  homing.begin({method, reverse, fast, 2}, switches_for(method, reverse), place);
  Outcome out;
  for (int i = 0; i < 200'000 && homing.running(); ++i) {
    const double wanted = homing.step(place, dead);
    speed += std::clamp(wanted - speed, -2.0, 2.0);
    place += 0.001 * speed;
    if (out.first_way == 0) out.first_way = sign * speed;
    out.farthest = std::max(out.farthest, std::abs(place));
    if (homing.stopping() && speed == 0) {
      out.found = !homing.failed();
      out.home = sign * homing.home();
      homing.end();
    }
  }
  return out;
}

double expected(const Figure& figure, bool index, double start) {
  const double edge = figure.at == At::kNegativeLimit   ? -kLimit
                      : figure.at == At::kPositiveLimit ? kLimit
                      : figure.at == At::kLowEdge       ? kLow
                      : figure.at == At::kHighEdge      ? kHigh
                                                        : start;
  if (!index) return edge;
  const double turns = (edge - kIndex) / kPitch;
  return kIndex + kPitch * (figure.index > 0 ? std::ceil(turns) : std::floor(turns));
}

TEST(EmulatedHoming, EveryMethodFindsThePlaceOfItsFigureFromEverywhere) {
  int runs = 0;
  for (const Figure& figure : kFigures)
    for (const bool index : {true, false})
      for (const bool reverse : {false, true})
        for (const double start :
             {-kLimit - 1, -50.0, kLow + 3, 0.0, kHigh - 0.01, kHigh + 0.01, 60.0, kLimit + 1}) {
          if (!index && figure.method > 30) continue;
          const int method = index ? figure.method : figure.method + 16;
          const bool leaves_axis = figure.at == At::kNowhere && std::abs(start) > kLimit;
          if (leaves_axis) continue;
          const Outcome out = home(method, reverse, start);
          ASSERT_TRUE(out.found) << "method " << method << " from " << start << (reverse ? " reversed" : "");
          EXPECT_NEAR(out.home, expected(figure, index, start), 1e-9)
              << "method " << method << " from " << start << (reverse ? " reversed" : "");
          EXPECT_LT(out.farthest, kLimit + 2);
          ++runs;
        }
  EXPECT_EQ(runs, 14 * 2 * 2 * 8 + 2 * 2 * 6);
}

// Beside the switch, on the side where the figures begin.
TEST(EmulatedHoming, SetsOutInTheWayOfTheFigure) {
  for (const Figure& figure : kFigures)
    for (const bool reverse : {false, true}) {
      const double start = figure.first > 0 ? kLow - 20 : kHigh + 20;
      EXPECT_GT(home(figure.method, reverse, start).first_way * figure.first, 0)
          << "method " << figure.method;
    }
}

// On the switch the figures go the short way to the edge: 3, 7 and 14 down, 5, 10 and 11 up.
TEST(EmulatedHoming, SetsOutFromTheSwitchInTheWayOfTheFigure) {
  for (const int down : {3, 4, 7, 8, 13, 14}) EXPECT_LT(home(down, false, 0).first_way, 0) << down;
  for (const int up : {5, 6, 9, 10, 11, 12}) EXPECT_GT(home(up, false, 0).first_way, 0) << up;
}

// A cam of 0.02 mm is passed at 20 mm/s within the stopping distance.
TEST(EmulatedHoming, ACamThatIsOverrunStillHasItsOwnEdge) {
  for (const int method : {23, 24, 25, 26}) {
    EmulatedHoming homing;
    double place = -5, speed = 0;
    homing.begin({method, false, 20, 2}, {0.0, 0.05, -10, 10, 0, 0}, place);
    bool found = false;
    for (int i = 0; i < 20'000 && homing.running() && !found; ++i) {
      const double wanted = homing.step(place, false);
      speed += std::clamp(wanted - speed, -2.0, 2.0);
      place += 0.001 * speed;
      found = homing.stopping() && !homing.failed();
    }
    ASSERT_TRUE(found) << method;
    EXPECT_EQ(homing.home(), method <= 24 ? 0.0 : 0.05) << method;
  }
}

TEST(EmulatedHoming, HereIsHere) {
  for (const int method : {35, 37}) {
    const Outcome out = home(method, false, 3.5);
    EXPECT_TRUE(out.found);
    EXPECT_EQ(out.home, 3.5);
    EXPECT_EQ(out.farthest, 3.5) << "it stays";
  }
}

TEST(EmulatedHoming, ADeadSwitchEndsAtALimitSwitch) {
  for (const Figure& figure : kFigures) {
    if (figure.at != At::kLowEdge && figure.at != At::kHighEdge) continue;
    const Outcome out = home(figure.method, false, 0, 20, true);
    EXPECT_FALSE(out.found) << "method " << figure.method;
    EXPECT_LT(out.farthest, kLimit + 2) << "method " << figure.method;
  }
}

TEST(EmulatedHoming, OtherNumbersAreRefused) {
  for (const int method : {-1, 0, 15, 16, 31, 32, 36, 38, 99}) {
    EXPECT_FALSE(EmulatedHoming::knows(method)) << method;
    EXPECT_FALSE(home(method, false, 0).found) << method;
  }
}

}  // namespace
}  // namespace trn
