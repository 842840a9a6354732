#include "app/check/deviation_meter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/axes.h"
#include "core/units.h"
#include "tests/app/check/table_moves.h"
#include "tests/support/rounds.h"

// Motions whose deviation from the program is known by construction.
namespace trn {
namespace {

class Meter : public ::testing::Test {
 protected:
  TableKinematics table_;
  DeviationMeter meter_{table_};

  Vec3 axis(double a_deg, double c_deg) const {
    return table_.orientation(Vec3(rad_from_deg(a_deg), 0, rad_from_deg(c_deg))).col(2);
  }
  void polyline(const std::vector<Vec3>& points, double tolerance_mm) {
    for (std::size_t i = 1; i < points.size(); ++i)
      meter_.programmed(line(words(points[i - 1]), words(points[i]), tolerance_mm));
  }
  // Straight motion from a to b (without its end) in steps of about `step`.
  void drive(const Vec3& a, const Vec3& b, double step, std::uint32_t line = 0) {
    const int count = std::max(1, static_cast<int>((b - a).norm() / step));
    for (int i = 0; i < count; ++i) meter_.sample(a + (b - a) * i / count, kUp, line);
  }
};

TEST_F(Meter, OnThePathThereIsNoDeviation) {
  polyline({{0, 0, 0}, {10, 0, 0}, {10, 5, 2}}, 0);
  drive({0, 0, 0}, {10, 0, 0}, 0.1);
  drive({10, 0, 0}, {10, 5, 2}, 0.1);
  EXPECT_LT(meter_.report().tip_mm.value, 1e-13);
  EXPECT_LT(meter_.report().tip_exact_mm.value, 1e-13);
  EXPECT_LT(meter_.report().axis_deg.value, 1e-13);
  EXPECT_EQ(meter_.report().lost, 0u);
}

TEST_F(Meter, SidewaysOffsetIsTheDeviation) {
  polyline({{0, 0, 0}, {10, 0, 0}}, 0.01);
  drive({0, 0, 0}, {5, 0, 0}, 0.1, 1);
  meter_.sample({5, 0.003, 0.004}, kUp, 42);
  drive({5.1, 0, 0}, {10, 0, 0}, 0.1, 3);
  EXPECT_NEAR(meter_.report().tip_mm.value, 0.005, 1e-15);
  EXPECT_NEAR(meter_.report().tip_ratio.value, 0.5, 1e-12);
  EXPECT_EQ(meter_.report().tip_mm.line, 42u);
  EXPECT_EQ(meter_.report().tip_exact_mm.value, 0);
}

TEST_F(Meter, OfEqualDeviationsTheFirstIsNamed) {
  polyline({{0, 0, 0}, {16, 0, 0}}, 0.5);
  for (const std::uint32_t line : {1u, 2u, 3u}) meter_.sample({2.0 * line, 0, 0}, kUp, line);
  EXPECT_EQ(meter_.report().tip_mm.line, 0u) << "none";
  for (const std::uint32_t line : {4u, 5u, 6u}) meter_.sample({2.0 * line, 0.25, 0}, kUp, line);
  EXPECT_EQ(meter_.report().tip_mm.value, 0.25);
  EXPECT_EQ(meter_.report().tip_mm.line, 4u);
  EXPECT_EQ(meter_.report().tip_ratio.line, 4u);
}

TEST_F(Meter, ChamferedCornerDeviatesByHalfItsLeg) {
  polyline({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, 0.01);
  drive({0, 0, 0}, {9.98, 0, 0}, 0.1);
  drive({9.98, 0, 0}, {10, 0.02, 0}, 1e-5);
  drive({10, 0.02, 0}, {10, 10, 0}, 0.1);
  EXPECT_NEAR(meter_.report().tip_mm.value, 0.01, 1e-8);
  EXPECT_NEAR(meter_.report().tip_ratio.value, 1.0, 1e-6);
}

TEST_F(Meter, ExactModeMeasuresMicrometresToo) {
  polyline({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, 0);
  drive({0, 0, 0}, {9.99, 0, 0}, 0.1);
  drive({9.99, 0, 0}, {10, 0.01, 0}, 1e-5, 9);
  drive({10, 0.01, 0}, {10, 10, 0}, 0.1);
  EXPECT_NEAR(meter_.report().tip_exact_mm.value, 0.005, 1e-8);
  EXPECT_EQ(meter_.report().tip_exact_mm.line, 9u);
  EXPECT_EQ(meter_.report().lost, 0u);
}

TEST_F(Meter, WayOutAndBackIsNoDeviation) {
  // The sharpest corner: the return lies on the way out; rounding must not tempt the meter across.
  polyline({{0, 0, 0}, {10, 0, 0}, {0, 0, 0}, {10, 0, 0}}, 0);
  const std::vector<std::pair<double, double>> ways = {{0, 10}, {10, 0}, {0, 10}};
  for (const auto& [a, b] : ways)
    for (int i = 0; i < 1000; ++i) meter_.sample({a + (b - a) * i / 1000, 1e-12 * ((i % 3) - 1), 0}, kUp, 0);
  EXPECT_LT(meter_.report().tip_mm.value, 2e-12);
  EXPECT_EQ(meter_.held_moves(), 1u);
}

TEST_F(Meter, SpikeMayBeCutWithoutLosingTheWay) {
  // A spike of 4 degrees: motion between its legs is near both; each sample is measured to the nearer one.
  const double half = rad_from_deg(2.0);
  const Vec3 tip(10, 0, 0), left(0, 10 * std::tan(half), 0), right(0, -10 * std::tan(half), 0);
  polyline({left, tip, right}, 0.01);
  drive(left, left + 0.985 * (tip - left), 0.05);
  // From one leg straight over to the other, 0.15 mm before the tip.
  const Vec3 a = left + 0.985 * (tip - left), b = right + 0.985 * (tip - right);
  drive(a, b, 1e-5);
  drive(b, right, 0.05);
  EXPECT_NEAR(meter_.report().tip_mm.value, a.y() * std::cos(half), 1e-5);
  EXPECT_LT(meter_.report().tip_ratio.value, 1.0);
  EXPECT_EQ(meter_.report().lost, 0u);
}

// Its share of the tolerance is less than a tight move had before. That does not settle how many millimetres
// it is: the nearer leg of the spike counts all the same.
TEST_F(Meter, ASmallShareOfAWideToleranceIsStillMeasuredToTheNearerLeg) {
  const double half = rad_from_deg(2.0);
  const Vec3 tip(10, 0, 0), left(0, 10 * std::tan(half), 0), right(0, -10 * std::tan(half), 0);
  const Vec3 begin = left - Vec3(0, 0, 5);
  polyline({begin, left}, 0.002);
  polyline({left, tip, right}, 0.05);
  drive(begin + Vec3(0.0016, 0, 0), left + Vec3(0.0016, 0, 0), 0.05);
  const Vec3 a = left + 0.985 * (tip - left), b = right + 0.985 * (tip - right);
  drive(left, a, 0.05);
  drive(a, b, 1e-5);
  drive(b, right, 0.05);
  EXPECT_NEAR(meter_.report().tip_ratio.value, 0.8, 1e-9);
  EXPECT_NEAR(meter_.report().tip_mm.value, a.y() * std::cos(half), 1e-5);
  EXPECT_EQ(meter_.report().lost, 0u);
}

TEST_F(Meter, LapsOfACircleAreNotMistakenForEachOther) {
  // Three turns of a helix rising 0.02 a turn: other turns are near, but only the right one is at the height.
  const Words from = words({5, 0, 0});
  meter_.programmed(arc(from, Vec3::Zero(), 6 * kPi, 0.06));
  for (int i = 0; i <= 6000; ++i) {
    const double share = i / 6000.0, t = 6 * kPi * share;
    const double radius = i == 3000 ? 5.003 : 5.0;
    meter_.sample({radius * std::cos(t), radius * std::sin(t), 0.06 * share}, kUp, i == 3000 ? 30 : 1);
  }
  // The nearest place of so flat a helix is that of the circle, but for (rise / turn / radius)^2.
  EXPECT_NEAR(meter_.report().tip_mm.value, 0.003, 1e-9);
  EXPECT_EQ(meter_.report().tip_mm.line, 30u);
}

TEST_F(Meter, ArcsAreExact) {
  meter_.programmed(arc(words({20, 0, 0}), Vec3(0, 0, 0), -1.5 * kPi, -7, 0));
  for (int i = 0; i <= 5000; ++i) {
    const double share = i / 5000.0, t = -1.5 * kPi * share;
    meter_.sample({20 * std::cos(t), 20 * std::sin(t), -7 * share}, kUp, 1);
  }
  EXPECT_LT(meter_.report().tip_exact_mm.value, 1e-13);
}

TEST_F(Meter, ArcOfRoundedNumbersEndsWhereItIsProgrammed) {
  ProgramMove move = arc(words({20, 0, 0}), Vec3(0, 0, 0), kPi / 2, 0, 0);
  move.to.head<3>() = Vec3(0, 20.002, 0);
  meter_.programmed(move);
  meter_.programmed(line(move.to, words({0, 30, 0}), 0));
  for (int i = 0; i <= 1000; ++i) {
    const double t = kPi / 2 * i / 1000;
    meter_.sample({20 * std::cos(t), 20 * std::sin(t) + 0.002 * i / 1000, 0}, kUp, 1);
  }
  drive({0, 20.002, 0}, {0, 30, 0}, 0.1);
  EXPECT_LT(meter_.report().tip_exact_mm.value, 1e-13);
}

TEST_F(Meter, CrossingPathIsMeasuredOnItsOwnBranch) {
  // A bow tie; at the crossing a sideways offset is measured to the branch that is being driven.
  polyline({{0, 0, 0}, {10, 10, 0}, {10, 0, 0}, {0, 10, 0}}, 0.1);
  drive({0, 0, 0}, {5, 5, 0}, 0.1);
  meter_.sample(Vec3(5, 5, 0) + 0.2 * Vec3(1, -1, 0), kUp, 5);  // lies on the later branch
  drive({5.1, 5.1, 0}, {10, 10, 0}, 0.1);
  EXPECT_NEAR(meter_.report().tip_mm.value, 0.2 * std::sqrt(2), 1e-12);
  EXPECT_EQ(meter_.report().tip_mm.line, 5u);
}

TEST_F(Meter, TurnOnTheSpotHasItsAxisOnTheProgrammedCone) {
  // C turns with A tilted: the axis runs on a cone. Tilted 0.03 deg further it is off by just that.
  meter_.programmed(line(words({1, 2, 3}, 20, 0), words({1, 2, 3}, 20, 90)));
  for (int i = 0; i <= 900; ++i) meter_.sample({1, 2, 3}, axis(20, 0.09 * i), 1);
  EXPECT_LT(meter_.report().axis_deg.value, 1e-6);
  for (int i = 900; i <= 1000; ++i) meter_.sample({1, 2, 3}, axis(20.03, 0.09 * i), 2);
  EXPECT_NEAR(meter_.report().axis_deg.value, 0.03, 1e-6);
  EXPECT_NEAR(meter_.report().axis_ratio.value, 0.6, 1e-4);
  EXPECT_EQ(meter_.report().axis_deg.line, 2u);
  EXPECT_EQ(meter_.report().tip_mm.value, 0);
}

TEST_F(Meter, TurnsOnTheSpotInARow) {
  const std::vector<std::pair<double, double>> places = {
      {22.18, 40.96}, {21.62, 41.63}, {20.68, 42.19}, {20.68, 42.19}};
  const Vec3 p(76.281, 59.637, 14.12);
  for (std::size_t i = 1; i < places.size(); ++i)
    meter_.programmed(line(words(p, places[i - 1].first, places[i - 1].second),
                           words(p, places[i].first, places[i].second), 0));
  for (std::size_t i = 1; i + 1 < places.size(); ++i)
    for (int k = 0; k <= 200; ++k) {
      const double s = k / 200.0;
      meter_.sample(p,
                    axis(places[i - 1].first + s * (places[i].first - places[i - 1].first),
                         places[i - 1].second + s * (places[i].second - places[i - 1].second)),
                    1);
    }
  EXPECT_LT(meter_.report().axis_exact_deg.value, 1e-6);
  EXPECT_EQ(meter_.report().tip_mm.value, 0);
}

TEST_F(Meter, AxisIsJudgedWhereTheTipIsWithinTolerance) {
  // 10 mm with 10 deg of tilt: one degree a millimetre. An axis that runs 0.03 deg ahead is right 0.03 mm
  // further, which is outside the tolerance of 0.01 mm: 0.02 deg remain.
  meter_.programmed(line(words({0, 0, 0}, 0, 0), words({10, 0, 0}, 10, 0)));
  for (int i = 0; i <= 90; ++i) meter_.sample({i * 0.1, 0, 0}, axis(i * 0.1 + 0.03, 0), 1);
  EXPECT_NEAR(meter_.report().axis_deg.value, 0.02, 2e-6);
  EXPECT_NEAR(meter_.report().tip_mm.value, 0, 1e-13);
}

TEST_F(Meter, JumpOfTheFrameIsNoMotion) {
  ProgramMove before = line(words({0, 0, 80}), words({10, 0, 80}));
  before.context.rtcp = false;
  meter_.programmed(before);
  const ProgramMove after = line(words({10, 0, 5}), words({10, 8, 5}));
  meter_.programmed(after);
  meter_.enter(before.context);
  drive({0, 0, 80}, {10, 0, 80}, 0.2);
  for (int i = 0; i < 5; ++i) meter_.sample({10, 1e-4, 80}, kUp, 1);  // corrections leave a little
  meter_.enter(after.context);
  for (int i = 0; i < 5; ++i) meter_.sample({10, 0, 5}, kUp, 2);
  drive({10, 0, 5}, {10, 8, 5}, 0.2);
  EXPECT_NEAR(meter_.report().tip_mm.value, 1e-4, 1e-12);
  EXPECT_EQ(meter_.report().lost, 0u);
}

TEST_F(Meter, TurnsBehindEachOtherHaveTheSameAxis) {
  // The end of the second turn of C is near the first one, but not the nearest place.
  for (const double tolerance_mm : {0.0, 0.01}) {
    DeviationMeter meter(table_);
    meter.programmed(line(words({0, 0, 0}, 0, 0), words({0, 0, 0}, -73, 0), tolerance_mm));
    meter.programmed(line(words({0, 0, 0}, -73, 0), words({0, 0, 0}, -73, -682), tolerance_mm));
    for (int i = 0; i <= 2000; ++i) meter.sample({0, 0, 0}, axis(-73.0 * i / 2000, 0), 1);
    for (int i = 0; i <= 20000; ++i) meter.sample({0, 0, 0}, axis(-73, -682.0 * i / 20000), 2);
    EXPECT_LT(meter.report().axis_deg.value, 1e-7);
  }
}

TEST_F(Meter, WhatCorrectionsLeaveIsNoBrokenPromise) {
  polyline({{0, 0, 0}, {10, 0, 0}}, 0);
  drive({0, 0, 0}, {2, 0, 0}, 0.1);
  meter_.sample({2, 0.002, 0}, kUp, 1, {0.003, 0});
  EXPECT_EQ(meter_.report().tip_exact_mm.value, 0.002);
  EXPECT_FALSE(meter_.report().broken());
  meter_.sample({2, 0.002, 0}, kUp, 7, {0.001, 0});
  EXPECT_TRUE(meter_.report().broken());
  EXPECT_NEAR(meter_.report().tip_over_mm.value, 0.001, 1e-5);
  EXPECT_EQ(meter_.report().tip_over_mm.line, 7u);
}

// What a correction leaves may point forward in one sample and back in the next: the place must stay near
// enough to the start to fit both, though the first fits exactly a little further on.
TEST_F(Meter, WhatCorrectionsLeaveDoesNotMoveThePlaceAhead) {
  constexpr double kLeftDeg = 0.01;
  meter_.programmed(line(words({1, 2, 3}, 20, 0), words({1, 2, 3}, 30, 0), 0));
  for (int i = 0; i <= 1000; ++i) {
    const double off_deg = i % 2 == 0 ? kLeftDeg : -kLeftDeg;
    meter_.sample({1, 2, 3}, axis(20 + 0.001 * i + off_deg, 0), 1, {0, kLeftDeg * (1 + 1e-6)});
  }
  EXPECT_FALSE(meter_.report().broken());
  EXPECT_LE(meter_.report().axis_deg.value, kLeftDeg * (1 + 1e-6));
}

// A sample may be ahead of its place by a tolerance and the next one behind by as much, on the other side of
// a corner too.
TEST_F(Meter, AStepBackOverACornerWithinTheToleranceIsNoDeviation) {
  polyline({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, 0.1);
  drive({0, 0, 0}, {10, 0, 0}, 0.1);
  meter_.sample({10, 0.12, 0}, kUp, 1);  // beyond the tolerance of the first leg
  meter_.sample({9.93, 0, 0}, kUp, 2);
  EXPECT_LT(meter_.report().tip_mm.value, 1e-12);
  EXPECT_EQ(meter_.report().lost, 0u);
}

// A place that was passed counts for as little as two tolerances, also where every move is short.
TEST_F(Meter, JumpBackOverShortMovesIsSeen) {
  std::vector<Vec3> points;
  for (int i = 0; i <= 20; ++i) points.push_back({0.5 * i, 0, 0});
  polyline(points, 0.01);
  drive({0, 0, 0}, {8, 0, 0}, 0.1, 1);
  meter_.sample({2, 0, 0}, kUp, 9);
  EXPECT_NEAR(meter_.report().tip_mm.value, 5.9, 0.1) << "the samples stood at 7.9, two tolerances are 0.02";
  EXPECT_EQ(meter_.report().tip_mm.line, 9u);
  EXPECT_EQ(meter_.report().lost, 1u);
}

TEST_F(Meter, HistogramHoldsTwentiethsOfTheToleranceAndWhatIsBeyond) {
  DeviationMeter meter(table_, true);
  meter.programmed(line(words({0, 0, 0}, 20, 0), words({10, 0, 0}, 20, 0), 0.01, 0.05));
  const std::vector<double> tip_shares = {0, 0.26, 0.51, 0.96, 1.2, 3};
  const std::vector<double> axis_shares = {0, 0.01, 0.53, 0.54, 1.01, 2};
  for (std::size_t i = 0; i < tip_shares.size(); ++i)
    meter.sample({static_cast<double>(i), 0.01 * tip_shares[i], 0}, axis(20 + 0.05 * axis_shares[i], 0), 1);
  DeviationHistogram tip{}, axis{};
  tip[0] = tip[5] = tip[10] = tip[19] = 1;
  tip[20] = 2;
  axis[0] = axis[10] = axis[20] = 2;
  EXPECT_EQ(meter.report().tip_histogram, tip);
  EXPECT_EQ(meter.report().axis_histogram, axis);
}

// Random turns on the spot, each followed by a straight move, in an exact mode. The axis is off by a constant
// tilt all the time: by as much as a correction leaves at the pole, and once by more than anything allows.
// The tip is right.
TEST_F(Meter, TiltThatStaysDoesNotHoldThePlaceBack) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    DeviationMeter meter(table_);
    const double off_deg = std::pow(10, -3 + u(rng)), left_deg = seed % 2 == 0 ? off_deg : 0;
    const double a_begin = 10 * u(rng), a_end = 3 * u(rng), c = 20 * u(rng);
    const Vec3 p(10 * u(rng), 10 * u(rng), 10 * u(rng)), q = p + 20 * Vec3(u(rng), u(rng), u(rng));
    meter.programmed(line(words(p, a_begin, 0), words(p, a_end, c), 0));
    meter.programmed(line(words(p, a_end, c), words(q, a_end, c), 0));
    const auto sample = [&](const Vec3& tip, double share) {
      const Vec3 programmed = axis(a_begin + share * (a_end - a_begin), share * c);
      // About a line square to the axis: nowhere on the way is the axis nearer than this by much.
      const Vec3 tilt = programmed.unitOrthogonal() * rad_from_deg(off_deg);
      meter.sample(tip, (programmed + tilt).normalized(), 1, {0, left_deg * (1 + 1e-6)});
    };
    for (int i = 0; i <= 400; ++i) sample(p, i / 400.0);
    for (int i = 0; i <= 400; ++i) sample(p + (q - p) * i / 400, 1);
    EXPECT_LT(meter.report().tip_mm.value, 1e-12) << "seed " << seed;
    EXPECT_EQ(meter.report().lost, 0u) << "seed " << seed;
    EXPECT_LE(meter.report().axis_deg.value, off_deg * (1 + 1e-6)) << "seed " << seed;
    EXPECT_EQ(meter.report().broken(), seed % 2 == 1) << "seed " << seed;
  }
}

// An exact lap, its axis off by what the corrections leave, is no part of the next move, which crosses the
// lap within its own wide tolerance.
TEST_F(Meter, WhatTheCorrectionsLeaveDoesNotMakeAMoveTheNextOne) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> u(-1, 1);
    DeviationMeter meter(table_);
    const double off_deg = std::pow(10, -3 + u(rng)), off_mm = seed % 3 == 0 ? std::pow(10, -4 + u(rng)) : 0;
    const auto corner = [&] { return Vec3(2 * u(rng), 2 * u(rng), 0); };
    const std::array<Vec3, 5> lap = {Vec3::Zero(), corner(), corner(), corner(), Vec3(0.3, 0.1, 0)};
    for (std::size_t i = 1; i < lap.size(); ++i)
      meter.programmed(line(words(lap[i - 1], 0, 0), words(lap[i], 0, 0), 0));
    const Vec3 end(0.1 * u(rng), 0.1 * u(rng), -0.1);
    meter.programmed(line(words(lap[4], 0, 0), words(end, 0.3, 0), 0.45));
    const Vec3 axis_off = (axis(0, 0) + rad_from_deg(off_deg) * Vec3::UnitX()).normalized();
    const auto sample = [&](const Vec3& tip, const Vec3& tilted) {
      meter.sample(tip + off_mm * Vec3::UnitZ(), tilted, 1, {off_mm * (1 + 1e-6), off_deg * (1 + 1e-6)});
    };
    for (std::size_t i = 1; i < lap.size(); ++i)
      for (int k = 0; k <= 200; ++k) sample(lap[i - 1] + (lap[i] - lap[i - 1]) * k / 200, axis_off);
    for (int k = 1; k <= 200; ++k) sample(lap[4] + (end - lap[4]) * k / 200, axis(0.3 * k / 200, 0));
    EXPECT_EQ(meter.report().lost, 0u) << "seed " << seed;
    EXPECT_LE(meter.report().tip_mm.value, off_mm + 1e-9) << "seed " << seed;
    EXPECT_FALSE(meter.report().broken()) << "seed " << seed;
  }
}

TEST_F(Meter, GrossErrorIsRecordedAndTheWayFoundAgain) {
  polyline({{0, 0, 0}, {100, 0, 0}, {100, 100, 0}}, 0.01);
  drive({0, 0, 0}, {20, 0, 0}, 0.1, 1);
  drive({60, 30, 0}, {60, 31, 0}, 0.1, 7);
  const double gross = meter_.report().tip_mm.value;
  EXPECT_NEAR(gross, 40.0 + 0, 20);  // measured to the window's end or straight down, at least 30
  EXPECT_GE(gross, 30.0);
  EXPECT_GT(meter_.report().lost, 0u);
  drive({70, 0, 0}, {100, 0, 0}, 0.1, 8);
  drive({100, 0, 0}, {100, 100, 0}, 0.1, 9);
  EXPECT_LE(meter_.report().tip_mm.line, 7u);
  EXPECT_EQ(meter_.held_moves(), 1u);
}

TEST_F(Meter, OldMovesAreDropped) {
  // 20,000 tiny moves, fed 500 ahead of the samples.
  const auto place = [](int i) { return Vec3(0.02 * i, std::sin(0.01 * i), 0); };
  std::size_t held_max = 0;
  for (int i = 0; i < 20000; ++i) {
    meter_.programmed(line(words(place(i)), words(place(i + 1))));
    if (i >= 500) meter_.sample(place(i - 500), kUp, 1);
    held_max = std::max(held_max, meter_.held_moves());
  }
  EXPECT_LE(held_max, 600u);
  EXPECT_LT(meter_.report().tip_mm.value, 1e-9);
}

// Random paths of lines and helices, driven with a random offset: the true deviation lies between the
// distance to the whole path and the offset.
TEST_F(Meter, RandomPathsAreBoundedByTheOffset) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int round = 0; round < 8; ++round) {
    DeviationMeter meter(table_);
    std::vector<ProgramMove> moves;
    Words at = words({0, 0, 0});
    for (int i = 0; i < 30; ++i) {
      if (i % 3 == 2) {
        const Vec3 centre = at.head<3>() + 3 * Vec3(u(rng), u(rng), 0);
        moves.push_back(arc(at, centre, 4 * u(rng), u(rng), 0.05));
      } else {
        moves.push_back(
            line(at, words(at.head<3>() + 4 * Vec3(u(rng), u(rng), u(rng)), 30 * u(rng), 90 * u(rng)), 0.05));
      }
      at = moves.back().to;
      meter.programmed(moves.back());
    }
    double offset_max = 0, nearest_max = 0;
    for (const ProgramMove& move : moves) {
      const ProgrammedLeg leg(move, table_);
      for (int k = 0; k < 200; ++k) {
        const Vec3 offset = 0.02 * Vec3(u(rng), u(rng), u(rng));
        const Vec3 p = leg.tip(k / 200.0) + offset;
        offset_max = std::max(offset_max, offset.norm());
        double nearest = 1e9;
        std::vector<LegPlace> places;
        for (const ProgramMove& other : moves) ProgrammedLeg(other, table_).nearest(p, 0, 1, places);
        for (const LegPlace& found : places) nearest = std::min(nearest, found.distance_mm);
        nearest_max = std::max(nearest_max, nearest);
        meter.sample(p, leg.axis(k / 200.0), 1);
      }
    }
    EXPECT_LE(meter.report().tip_mm.value, offset_max + 1e-12);
    EXPECT_GE(meter.report().tip_mm.value, nearest_max - 1e-12);
    EXPECT_LE(meter.report().axis_deg.value, 1e-6);
    EXPECT_EQ(meter.report().lost, 0u);
  }
}

// A judge without cleverness: looks at thousands of places of every leg, then between them.
class DenseJudge {
 public:
  DenseJudge(const std::vector<ProgramMove>& moves, const Kinematics& kinematics) {
    for (const ProgramMove& move : moves) legs_.emplace_back(move, kinematics);
  }
  /// Distance over tolerance, and angle over tolerance where the tip fits, over the legs [from, to).
  std::pair<double, double> ratios(const Vec3& p, const Vec3& u, std::size_t from, std::size_t to) const {
    double tip = 1e9, axis = 1e9;
    for (std::size_t i = from; i < to; ++i) {
      const ProgrammedLeg& leg = legs_[i];
      const auto distance = [&](double s) { return (leg.tip(s) - p).norm(); };
      const auto angle = [&](double s) {
        return distance(s) <= leg.tolerance_mm() + 1e-6 ? angle_deg(u, leg.axis(s)) : 1e9;
      };
      tip = std::min(tip, least(distance) / leg.tolerance_mm());
      axis = std::min(axis, least(angle) / leg.tolerance_deg());
    }
    return {tip, axis};
  }

 private:
  template <typename Function>
  static double least(const Function& f) {
    constexpr int kPlaces = 600;
    std::vector<double> at(kPlaces + 1);
    for (int i = 0; i <= kPlaces; ++i) at[static_cast<std::size_t>(i)] = f(1.0 * i / kPlaces);
    double best = *std::min_element(at.begin(), at.end());
    for (std::size_t i = 0; i <= kPlaces; ++i) {
      if ((i > 0 && at[i - 1] < at[i]) || (i < kPlaces && at[i + 1] < at[i])) continue;
      double from = (static_cast<double>(i) - 1) / kPlaces, to = (static_cast<double>(i) + 1) / kPlaces;
      from = std::max(from, 0.0);
      to = std::min(to, 1.0);
      for (int k = 0; k < 60; ++k) {
        const double a = from + (to - from) * 0.382, b = from + (to - from) * 0.618;
        const double fa = f(a), fb = f(b);
        best = std::min({best, fa, fb});
        (fa < fb ? to : from) = fa < fb ? b : a;
      }
    }
    return best;
  }
  std::vector<ProgrammedLeg> legs_;
};

ProgramMove random_leg(const Words& at, std::mt19937_64& rng, double tolerance_mm, double tolerance_deg) {
  std::uniform_real_distribution<double> u(-1, 1);
  const double size = std::pow(10, 1.5 * u(rng) - 0.5);
  Words to = at;
  if (u(rng) > -0.4) to.head<3>() += size * Vec3(u(rng), u(rng), 0.3 * u(rng));
  if (u(rng) > 0) to[kA] += rad_from_deg(40 * u(rng));
  if (u(rng) > 0) to[kC] += rad_from_deg((u(rng) > 0.5 ? 700 : 60) * u(rng));
  ProgramMove move = line(at, to, tolerance_mm, tolerance_deg);
  if (u(rng) > 0.4) {
    move = arc(at, at.head<3>() + size * Vec3(u(rng), u(rng), 0), 7 * u(rng), size * u(rng), tolerance_mm);
    move.to.tail<3>() = to.tail<3>();
    move.tolerance_rad = rad_from_deg(tolerance_deg);
  }
  return move;
}

// Against a dense walk: an arc that is short, rises steeply, or is far from the point has its minimum too.
TEST_F(Meter, NearestPlacesOfAnArcAreThoseOfADenseWalk) {
  for (int round = 0; round < test::rounds(2000); ++round) {
    std::mt19937_64 rng(static_cast<std::uint64_t>(round));
    std::uniform_real_distribution<double> u(-1, 1);
    const double radius = std::pow(10, 1.5 * u(rng)), sweep = std::pow(10, 1.5 * u(rng) - 1);
    const Words from = words(300 * Vec3(u(rng), u(rng), u(rng)));
    const Vec3 centre = from.head<3>() + radius * rot_z(kPi * u(rng)).col(0);
    const ProgrammedLeg leg(arc(from, centre, u(rng) < 0 ? sweep : -sweep, radius * std::pow(10, u(rng) - 1)),
                            table_);
    const double begin = 0.4 * (1 + u(rng)), end = begin + (1 - begin) * 0.5 * (1 + u(rng));
    const Vec3 off = std::pow(10, -6 + 4 * u(rng)) * Vec3(u(rng), u(rng), u(rng));
    const Vec3 p = leg.tip(begin + (end - begin) * 0.5 * (1 + u(rng))) + off;
    std::vector<LegPlace> found;
    leg.nearest(p, begin, end, found);
    double best = 1e9, dense = 1e9;
    for (const LegPlace& place : found) best = std::min(best, place.distance_mm);
    for (int k = 0; k <= 4000; ++k)
      dense = std::min(dense, (leg.tip(begin + (end - begin) * k / 4000) - p).norm());
    EXPECT_LE(best, dense + 1e-10) << "seed " << round;
  }
}

// The truth is that of all places; those of the legs around may be farther off only at a crossing.
TEST_F(Meter, TellsTheTruthOnRandomPrograms) {
  for (int round = 0; round < test::rounds(4); ++round) {
    std::mt19937_64 rng(static_cast<std::uint64_t>(round));
    std::uniform_real_distribution<double> u(-1, 1);
    const double tolerance_mm = std::pow(10, -1.5 + u(rng)), tolerance_deg = std::pow(10, -1.5 + u(rng));
    DeviationMeter meter(table_);
    std::vector<ProgramMove> moves;
    Words at = words({0, 0, 0});
    for (std::size_t i = 0; i < 8; ++i) {
      moves.push_back(random_leg(at, rng, tolerance_mm, tolerance_deg));
      at = moves.back().to;
      meter.programmed(moves.back());
    }
    const DenseJudge judge(moves, table_);
    double tip = 0, axis = 0, tip_near = 0, axis_near = 0;
    for (std::size_t i = 0; i < moves.size(); ++i) {
      const ProgrammedLeg leg(moves[i], table_);
      const Words from = moves[i].from, way = moves[i].to - from;
      const Vec3 off = 0.6 * tolerance_mm * u(rng) * Vec3(u(rng), u(rng), u(rng));
      const double a_off = rad_from_deg(0.6 * tolerance_deg) * u(rng);
      const int steps = 40 + static_cast<int>(way.tail<3>().norm() / rad_from_deg(2.0));
      for (int k = 0; k <= steps; ++k) {
        const double s = 1.0 * k / steps, swell = std::sin(kPi * s);
        const Vec3 p = leg.tip(s) + swell * off;
        Vec3 abc = (from + s * way).tail<3>();
        abc[0] += swell * a_off;
        const Vec3 axis_now = table_.orientation(abc).col(2);
        meter.sample(p, axis_now, 1);
        const auto near = judge.ratios(p, axis_now, i, i + 1);
        const auto all = k % 8 > 0 ? std::pair(0.0, 0.0) : judge.ratios(p, axis_now, 0, moves.size());
        tip = std::max(tip, all.first);
        axis = std::max(axis, all.second);
        tip_near = std::max(tip_near, near.first);
        axis_near = std::max(axis_near, near.second);
      }
    }
    EXPECT_GE(meter.report().tip_ratio.value, tip - 1e-6) << "seed " << round;
    EXPECT_GE(meter.report().axis_ratio.value, axis - 1e-6) << "seed " << round;
    EXPECT_LE(meter.report().tip_ratio.value, tip_near + 0.01) << "seed " << round;
    EXPECT_LE(meter.report().axis_ratio.value, axis_near + 0.01) << "seed " << round;
    EXPECT_EQ(meter.report().lost, 0u);
  }
}

}  // namespace
}  // namespace trn
