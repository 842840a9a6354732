#include "app/session/range_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/units.h"
#include "tests/support/paths.h"

// Moves against the ranges that stand in the configs: mill X 300, Y 200, Z 250 mm; cradle A 120 degrees.
namespace trn {
namespace {

class RangeCheckOnMill : public ::testing::Test {
 protected:
  explicit RangeCheckOnMill(const std::string& machine = "mill")
      : assembly_(assemble(source_dir() + "/configs/" + machine + ".toml")) {}

  static Words at(double x, double y, double z, double a_deg = 0) {
    Words words = Words::Zero();
    words.head<3>() = Vec3(x, y, z);
    words[kA] = rad_from_deg(a_deg);
    return words;
  }
  ProgramMove line_to(const Words& to) {
    ProgramMove move;
    move.kind = ProgramMove::Kind::kFeed;
    move.from = here_;
    move.to = here_ = to;
    move.context.tool_offset = tool_;
    move.source.line = ++line_;
    return move;
  }
  ProgramMove arc_to(const Words& to, const Vec3& centre, double sweep_rad) {
    ProgramMove move = line_to(to);
    move.kind = ProgramMove::Kind::kArc;
    move.arc_centre = centre;
    move.arc_sweep_rad = sweep_rad;
    return move;
  }
  /// What has been refused since the last call.
  std::vector<RefusedMove> refused() { return std::exchange(refused_, {}); }

  Assembly assembly_;
  std::vector<RefusedMove> refused_;
  RangeCheck check_{assembly_, [this](const RefusedMove& refused) { refused_.push_back(refused); }};
  Words here_ = Words::Zero();
  Vec3 tool_ = Vec3::Zero();
  std::uint32_t line_ = 0;
};

TEST_F(RangeCheckOnMill, EveryJointIsHeldToBothEndsOfItsRange) {
  const double most[] = {300, 200, 250};
  for (int k = 0; k < 3; ++k)
    for (const double sign : {-1.0, 1.0}) {
      Words to = Words::Zero();
      to[k] = sign * most[k];
      check_.move(line_to(to));
      EXPECT_TRUE(refused().empty()) << "the end itself belongs to the range";
      to[k] = sign * (most[k] + 0.001);
      check_.move(line_to(to));
      const auto told = refused();
      ASSERT_EQ(told.size(), 1u) << "XYZ"[k];
      EXPECT_EQ(told[0].line, line_);
      EXPECT_EQ(told[0].letter, "XYZ"[k]);
      check_.move(line_to(Words::Zero()));
    }
  EXPECT_TRUE(refused().empty());
  EXPECT_EQ(check_.moves, 18u);
}

TEST_F(RangeCheckOnMill, SaysWhichJointGoesWhereAndWhatItsRangeIs) {
  check_.move(line_to(at(-300.5, 0, 0)));
  const auto told = refused();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].text,
            "joint X would go to -300.5000 mm, outside its range -300 to 300; move the work offset or "
            "the part, or change the program");
}

TEST_F(RangeCheckOnMill, EachJointIsToldOnceUntilItHasBeenInside) {
  check_.move(line_to(at(310, 0, 0)));
  check_.move(line_to(at(320, 0, 0)));
  EXPECT_EQ(refused().size(), 1u);
  check_.move(line_to(at(320, 210, 0)));
  ASSERT_EQ(refused_.size(), 1u) << "another joint";
  EXPECT_EQ(refused()[0].letter, 'Y');
  check_.move(line_to(at(299, 210, 0)));
  check_.move(line_to(at(310, 210, 0)));
  ASSERT_EQ(refused_.size(), 1u) << "inside in between";
  EXPECT_EQ(refused()[0].letter, 'X');
}

// From (280, -30) to (280, 30) about (280, 0): one half goes through X310, the other through X250.
TEST_F(RangeCheckOnMill, AnArcIsFollowedBetweenItsGoodEnds) {
  here_ = at(280, -30, 0);
  check_.move(arc_to(at(280, 30, 0), {280, 0, 0}, -kPi));
  EXPECT_TRUE(refused().empty());
  here_ = at(280, -30, 0);
  check_.move(arc_to(at(280, 30, 0), {280, 0, 0}, kPi));
  ASSERT_EQ(refused_.size(), 1u);
  EXPECT_EQ(refused()[0].letter, 'X');
  here_ = at(280, -30, 0);
  check_.move(arc_to(at(280, -30, 0), {280, 0, 0}, 2 * kPi));
  EXPECT_EQ(refused().size(), 1u) << "a full circle ends where it begins";
}

// Circles that touch the end of the range between any two of the places that are looked at, and those that
// are a hundredth of a micrometre too far.
TEST_F(RangeCheckOnMill, AnArcMayTouchTheEndAndGoNoFarther) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> radius(2, 150), angle(0.3, 3), turn(-0.2, 0.2);
  for (int i = 0; i < 300; ++i) {
    const double r = radius(random), sweep = angle(random), before = sweep / 2 + turn(random) * sweep;
    for (const double beyond : {0.0, 1e-5}) {
      const Vec3 centre(300 + beyond - r, 10, 0);
      const auto place = [&](double a) { return at(centre.x() + r * std::cos(a), 10 + r * std::sin(a), 0); };
      here_ = place(-before);
      check_.move(arc_to(place(sweep - before), centre, sweep));
      EXPECT_EQ(refused().size(), beyond > 0 ? 1U : 0U) << "radius " << r << " sweep " << sweep;
    }
  }
}

// Behind a homing switch at its end a joint stands a little outside. It may stay and come in, not go out.
TEST_F(RangeCheckOnMill, FromOutsideTheWayInIsOpen) {
  check_.stand_at(Vec3(300.5, 0, 0));
  here_ = at(300.5, 0, 0);
  check_.move(line_to(at(300.5, 20, 5)));
  check_.move(line_to(at(300.2, 0, 0)));
  EXPECT_TRUE(refused().empty());
  check_.move(line_to(at(300.3, 0, 0)));
  EXPECT_EQ(refused().size(), 1u) << "out again";
  check_.move(line_to(at(299, 0, 0)));
  check_.move(line_to(at(300.1, 0, 0)));
  EXPECT_EQ(refused().size(), 1u) << "it was in";
}

// What was good with one tool says nothing of a longer one, which the Z joint must make up for.
TEST_F(RangeCheckOnMill, AnotherToolIsJudgedAnew) {
  check_.move(line_to(at(0, 0, 220)));
  check_.move(line_to(at(0, 0, 0)));
  check_.move(line_to(at(0, 0, 220)));
  EXPECT_TRUE(refused().empty());
  tool_ = {0, 0, 50};
  check_.move(line_to(at(0, 0, 0)));
  check_.move(line_to(at(0, 0, 220)));
  ASSERT_EQ(refused_.size(), 1u);
  EXPECT_NE(refused_[0].text.find("joint Z would go to 270.0000 mm"), std::string::npos) << refused_[0].text;
}

TEST_F(RangeCheckOnMill, KeepsTheWayToAProgramBegunFurtherDown) {
  for (const double x : {10.0, 20.0}) {
    ProgramMove move = line_to(at(x, 0, 0));
    move.source.line = 0;
    check_.move(move);
  }
  check_.move(line_to(at(30, 0, 0)));
  ASSERT_EQ(check_.approach.size(), 2u);
  EXPECT_EQ(check_.approach[0], at(10, 0, 0));
  EXPECT_EQ(check_.approach[1], at(20, 0, 0));
}

class RangeCheckOnCradle : public RangeCheckOnMill {
 protected:
  RangeCheckOnCradle() : RangeCheckOnMill("cradle") {}
};

TEST_F(RangeCheckOnCradle, RotaryJointsAreToldInDegrees) {
  check_.move(line_to(at(0, 0, 0, -119)));
  EXPECT_TRUE(refused().empty());
  check_.move(line_to(at(0, 0, 0, -121)));
  ASSERT_EQ(refused_.size(), 1u);
  EXPECT_EQ(refused_[0].letter, 'A');
  EXPECT_NE(refused_[0].text.find("121.0000 deg, outside its range -120 to 120"), std::string::npos)
      << refused_[0].text;
}

}  // namespace
}  // namespace trn
