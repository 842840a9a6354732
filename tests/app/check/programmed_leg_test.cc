#include "app/check/programmed_leg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/units.h"
#include "tests/app/check/table_moves.h"

// Legs whose nearest places are known in closed form.
namespace trn {
namespace {

class Leg : public ::testing::Test {
 protected:
  TableKinematics table_;
  static std::vector<double> shares(const ProgrammedLeg& leg, const Vec3& p, double from, double to) {
    std::vector<LegPlace> places;
    leg.nearest(p, from, to, places);
    std::vector<double> out;
    for (const LegPlace& place : places) {
      EXPECT_NEAR(place.distance_mm, (leg.tip(place.share) - p).norm(), 1e-12);
      out.push_back(place.share);
    }
    return out;
  }
  static void expect_near(const std::vector<double>& found, const std::vector<double>& expected) {
    ASSERT_EQ(found.size(), expected.size()) << ::testing::PrintToString(found);
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-9);
  }
};

// From a point beside the circle the distance falls to the point's own angle, rises to the opposite one, and
// falls again: a minimum at the angle in every turn, and one at an end towards which it still falls.
TEST_F(Leg, ACircleHasOneMinimumATurnAndNoOther) {
  const ProgrammedLeg circle(arc(words({5, 0, 0}), Vec3::Zero(), 2 * kPi, 0), table_);
  expect_near(shares(circle, {0, 7, 0}, 0, 1), {0.25, 1});
  expect_near(shares(circle, {0, 3, 0}, 0, 1), {0.25, 1});
  expect_near(shares(circle, {0, -7, 0}, 0, 1), {0, 0.75});
  expect_near(shares(circle, {0, 7, 0}, 0.3, 0.6), {0.3});
  expect_near(shares(circle, {0, 7, 0}, 0.6, 0.9), {0.6, 0.9});
  expect_near(shares(circle, {0, 7, 0}, 0.1, 0.6), {0.25});
  const ProgrammedLeg three(arc(words({5, 0, 0}), Vec3::Zero(), 6 * kPi, 0), table_);
  expect_near(shares(three, {0, 7, 0}, 0, 1), {0.25 / 3, 1.25 / 3, 2.25 / 3, 1});
}

TEST_F(Leg, ALineHasTheFootOfThePerpendicularOrAnEnd) {
  const ProgrammedLeg leg(line(words({0, 0, 0}), words({10, 0, 0})), table_);
  expect_near(shares(leg, {4, 3, 0}, 0, 1), {0.4});
  expect_near(shares(leg, {4, 3, 0}, 0.5, 1), {0.5});
  expect_near(shares(leg, {14, 3, 0}, 0, 1), {1});
}

// Hundreds of turns of a table: every axis on the way is found again in a part as long as one search may look
// at, wherever it lies in it. A search over more would step over whole turns.
TEST_F(Leg, EveryAxisOfALongTurnIsFoundInWhatOneSearchLooksAt) {
  const ProgrammedLeg leg(line(words({0, 0, 0}, 30, 0), words({0, 0, 0}, 30, 200 * 360.0)), table_);
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> u(0, 1);
  const double part = leg.shares_at_once();
  ASSERT_GT(part, 0);
  ASSERT_LE(part, 1);
  for (int i = 0; i < 200; ++i) {
    const double from = u(rng) * (1 - part), share = from + u(rng) * part;
    // Off the way by a hundredth of a degree, or the search may stop at the first share that is as good.
    const Vec3 here = table_.orientation(Vec3(rad_from_deg(30.01), 0, 200 * 2 * kPi * share)).col(2);
    EXPECT_NEAR(leg.smallest_angle_deg(here, from, from + part, 0), 0.01, 1e-6) << "share " << share;
  }
}

// The table tilts while it turns: an axis on the way comes near it once in every turn, and is met in one of
// them. One that is tilted 0.01 deg further lies off the spiral by that, times the cosine of the spiral's
// slope.
TEST_F(Leg, OfTurnsThatDifferTheNearestIsFound) {
  const ProgrammedLeg leg(line(words({0, 0, 0}, 10, 0), words({0, 0, 0}, 40, 3 * 360.0)), table_);
  ASSERT_EQ(leg.shares_at_once(), 1);
  for (int i = 1; i < 60; ++i) {
    const double share = i / 60.0, tilt_rad = rad_from_deg(10.01 + 30 * share);
    const double slope = 30.0 / (3 * 360) / std::sin(tilt_rad);
    const Vec3 here = table_.orientation(Vec3(tilt_rad, 0, 3 * 2 * kPi * share)).col(2);
    EXPECT_NEAR(leg.smallest_angle_deg(here, 0, 1, 0), 0.01 / std::hypot(1, slope), 1e-6)
        << "share " << share;
  }
}

TEST_F(Leg, AShortTurnIsLookedAtAtOnce) {
  EXPECT_EQ(ProgrammedLeg(line(words({0, 0, 0}, 0, 0), words({0, 0, 0}, 30, 360)), table_).shares_at_once(),
            1);
  EXPECT_EQ(ProgrammedLeg(line(words({0, 0, 0}), words({1, 0, 0})), table_).shares_at_once(), 1);
}

}  // namespace
}  // namespace trn
