#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/motion.h"
#include "core/units.h"
#include "interp/move.h"
#include "tests/interp/gcode/run_program.h"

// Constant surface speed (G96) on the way to the planner, beside S / (2 pi r).
namespace trn {
namespace {

using test::MoveList;
using test::Session;

// Constant surface speed: the law, its axis and its limits, told again wherever one of them changes.
TEST(SurfaceSpeedMoves, SurfaceSpeedIsToldWithItsAxis) {
  Session session;
  session.config.spindle_rpm_max = 3000;
  const MoveList list = session.moves(
      "G21 G10 L2 P1 X30\nG0 X10\nG96 S100 M4\nG1 F500 X20\nG20\nG96 D2000 S100\nG1 X2\nG92 X1\nG1 X3\nG97 "
      "S900\nG1 X1\nM5\nM2\n");
  std::vector<QueueEvent> told;
  for (const QueueEvent& event : list.events)
    if (event.kind == QueueEvent::Kind::kSpindle) told.push_back(event);
  ASSERT_EQ(told.size(), 6U);
  const double metre = 1000 / (2 * kPi), foot = 304.8 / (2 * kPi);
  EXPECT_DOUBLE_EQ(told[0].surface.rpm_mm, -100 * metre) << "M4";
  EXPECT_DOUBLE_EQ(told[0].surface.axis_mm, 30);
  EXPECT_DOUBLE_EQ(told[0].surface.rpm_max, 3000);
  EXPECT_DOUBLE_EQ(told[0].value, -100 * metre / 10);
  EXPECT_DOUBLE_EQ(told[1].value, told[0].value) << "behind G0 the cut waits for it";
  EXPECT_DOUBLE_EQ(told[2].surface.rpm_mm, -100 * foot);
  EXPECT_DOUBLE_EQ(told[2].surface.rpm_max, 2000);
  EXPECT_DOUBLE_EQ(told[3].surface.axis_mm, 30 + 2 * 25.4 - 25.4) << "G92 before the next move";
  EXPECT_DOUBLE_EQ(told[4].value, -900) << "G97";
  EXPECT_FALSE(told[4].surface.acts());
  EXPECT_EQ(told[5].value, 0);
}

// Parts of a cut at F a turn: each has the feed of its own place. With exact stops there are no parts, and
// the slowest place counts.
TEST(SurfaceSpeedMoves, FeedATurnFollowsTheSurfaceSpeed) {
  const auto cut = [](const std::string& mode) {
    const MoveList list =
        Session().moves("G21 " + mode + " G0 X40\nG96 D2000 S100 M3\nG95 F0.2\nG1 X4\nM2\n");
    return std::vector<ProgramMove>(list.moves.begin() + 1, list.moves.end());
  };
  const double metre = 1000 / (2 * kPi);
  const auto parts = cut("G64");
  ASSERT_GT(parts.size(), 50U);
  ASSERT_LT(parts.size(), 90U);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const double r = (parts[i].from[kX] + parts[i].to[kX]) / 2;
    EXPECT_NEAR(parts[i].feed.tip_mm_s, 0.2 * std::min(2000.0, 100 * metre / r) / 60, 1e-9);
    EXPECT_TRUE(parts[i].feed.overrides.per_turn);
    if (i > 0) {
      EXPECT_EQ(parts[i].from, parts[i - 1].to);
    }
  }
  EXPECT_EQ(parts.back().to[kX], 4);
  const auto whole = cut("G61.1");
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_NEAR(whole[0].feed.tip_mm_s, 0.2 * 100 * metre / 40 / 60, 1e-9);
}

// From one side of the axis to the other, and without moving in X.
TEST(SurfaceSpeedMoves, SurfaceSpeedAcrossTheAxis) {
  const MoveList list = Session().moves("G21 G0 X-20\nG96 D1000 S100 M3\nG95 F0.2\nG1 X20\nG1 Z9\nM2\n");
  double least = 1e9, most = 0;
  for (const ProgramMove& move : list.moves) {
    if (move.kind != ProgramMove::Kind::kFeed) continue;
    least = std::min(least, move.feed.tip_mm_s);
    most = std::max(most, move.feed.tip_mm_s);
    EXPECT_TRUE(std::isfinite(move.feed.tip_mm_s));
  }
  EXPECT_DOUBLE_EQ(most, 0.2 * 1000 / 60) << "at D about the axis";
  EXPECT_NEAR(least, 0.2 * 100 * 1000 / (2 * kPi * 20) / 60, 1e-9) << "the cut along Z";
}

// A thread keeps the speed with which it begins; behind it the surface speed counts again.
TEST(SurfaceSpeedMoves, AThreadKeepsItsSpeedInG96) {
  Session session;
  session.config.io = session.config.spindle_encoder = true;
  const MoveList list = session.moves("G21 G0 X10\nG96 D2000 S100 M3\nG33 Z-5 K1\nG0 X20\nG1 X30 F100\nM2\n");
  using Kind = QueueEvent::Kind;
  const double rpm = 100 * 1000 / (2 * kPi * 10);
  std::vector<QueueEvent> events = list.events;
  ASSERT_GE(events.size(), 5U);
  EXPECT_TRUE(events[0].surface.acts());
  EXPECT_EQ(events[1].kind, Kind::kSpindle);
  EXPECT_FALSE(events[1].surface.acts());
  EXPECT_DOUBLE_EQ(events[1].value, rpm);
  EXPECT_EQ(events[2].kind, Kind::kGearStart);
  EXPECT_DOUBLE_EQ(events[2].value, 1.1 * rpm / 60);
  EXPECT_EQ(events[3].kind, Kind::kGearEnd);
  EXPECT_TRUE(events[4].surface.acts());
}

TEST(SurfaceSpeedMoves, SurfaceSpeedHasAnEnd) {
  EXPECT_EQ(
      Session().error("G96 S100 M3"),
      "p.ngc:1:1: G96 needs D, the greatest speed in rpm, or 'rpm_max' in the config's [io.spindle]: 'G96'; "
      "legal: add the word");
  EXPECT_NE(Session().error("G96 D0 S100 M3").find("D = 0 is not legal for G96"), std::string::npos);
  Session session;
  session.config.spindle_rpm_max = 3000;
  EXPECT_EQ(session.error("G96 S100 M3"), "");
  EXPECT_NE(session.error("G97 S3001 M3").find("S = 3001 is not legal for the spindle: 3000 rpm at most"),
            std::string::npos);
}

}  // namespace
}  // namespace trn
