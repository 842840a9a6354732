#include "interp/plan/speed/speed_planner.h"

#include <gtest/gtest.h>

#include <cstring>

#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/move.h"
#include "interp/plan/speed/speed_options.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

namespace trn::speed_test {
namespace {

constexpr double kDense = 1e-4;  // ten times denser than the period

void expect_within_limits(const Verdict& v) {
  EXPECT_LE(v.velocity, 1.000001);
  EXPECT_LE(v.acceleration, 1.000001);
  EXPECT_LE(v.jerk, 1.000001);
  EXPECT_LE(v.feed, 1.000001);
  EXPECT_LE(v.join, 1e-8);
  EXPECT_TRUE(v.ends_well);
}

Words along_x(double x) {
  Words w = Words::Zero();
  w[kX] = x;
  return w;
}

TEST(SpeedPlanner, StraightLineIsTheSevenSegmentCurve) {
  const IdentityMap map({kX});
  const Joints joints = linear_joints(1);
  for (const double length : {1e-4, 1e-2, 0.3, 1.0, 7.0, 30.0, 100.0, 1000.0, 10000.0})
    for (const double feed : {3.0, 200.0, 1000.0}) {
      if (length / feed > 60) continue;
      SCOPED_TRACE(length);
      const Planned r = run({make_line(along_x(0), along_x(length))}, joints, map, feed, full_shares());
      const Verdict v = judge(r.blocks, map, joints, kDense, feed);
      expect_within_limits(v);
      const double best = s_curve_time(length, std::min(feed, 500.0), 5000, 100000);
      EXPECT_LE(v.time_s, 1.01 * best);
      EXPECT_GE(v.time_s, 0.99999 * best);
      EXPECT_EQ(r.stats.fallbacks, 0u);
    }
}

TEST(SpeedPlanner, TinyTurnOfARotaryAxis) {
  const IdentityMap map({kX, kA});
  Joints joints = linear_joints(2);
  joints[1] = joint("A", JointKind::kRotary, 10, 2, 14, 280);
  Words to = Words::Zero();
  to[kA] = 1e-6 * kRadPerDeg;
  const Planned r = run({make_line(Words::Zero(), to)}, joints, map, 100, full_shares());
  const Verdict v = judge(r.blocks, map, joints, 1e-5);
  expect_within_limits(v);
  EXPECT_LE(v.time_s, 1.01 * s_curve_time(to[kA], 2, 14, 280));
}

TEST(SpeedPlanner, SlowestJointOfACoupledMoveDecides) {
  const IdentityMap map({kX, kC});
  Joints joints = linear_joints(2);
  joints[1] = joint("C", JointKind::kRotary, 100, 4, 26, 520);
  Words to = along_x(40);
  to[kC] = 1.5;
  const Planned r = run({make_line(Words::Zero(), to)}, joints, map, 1e9, full_shares());
  const Verdict v = judge(r.blocks, map, joints, kDense);
  expect_within_limits(v);
  EXPECT_LE(v.time_s, 1.01 * s_curve_time(1.5, 4, 26, 520));
}

TEST(SpeedPlanner, CircleIsNearItsOptimum) {
  const IdentityMap map({kX, kY});
  const Planned r = run(circle(20, 1), linear_joints(2), map, 150, full_shares());
  const Verdict v = judge(r.blocks, map, linear_joints(2), kDense, 150);
  expect_within_limits(v);
  EXPECT_LE(v.time_s, 1.01 * 0.9159);  // certified by an independent solver
}

void random_polylines(const JointMap& map, const Joints& joints, double step_mm, double turn_rad, int count) {
  std::mt19937_64 rng(11);
  const int rounds = test::rounds(6);
  for (int i = 0; i < rounds; ++i) {
    SCOPED_TRACE(i);
    const double feed = i % 2 == 0 ? 100 : 400, reach = i % 3 == 0 ? 0.05 : 0.5;
    const auto pieces = blended(random_vertices(rng, count, step_mm, turn_rad), reach);
    const Planned r = run(pieces, joints, map, feed, full_shares());
    const Verdict v = judge(r.blocks, map, joints, kDense, feed);
    expect_within_limits(v);
  }
}

TEST(SpeedPlanner, RandomBlendedPolylinesKeepAllLimits) {
  random_polylines(IdentityMap({kX, kY, kZ, kA, kC}), cradle_joints(), 5, 0.1, 20);
}

TEST(SpeedPlanner, RandomBlendedPolylinesOnATrunnionKeepAllLimits) {
  random_polylines(TrunnionMap(), cradle_joints(), 5, 0.1, 20);
  random_polylines(TrunnionMap(), cradle_joints(), 0.5, 0.01, 60);
}

bool same(const TimeSegment& a, const TimeSegment& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(SpeedPlanner, TwoRunsGiveTheSameBits) {
  std::mt19937_64 rng(3);
  const auto pieces = blended(random_vertices(rng, 60, 3, 0.05), 0.3);
  const TrunnionMap map;
  const Planned a = run(pieces, cradle_joints(), map, 100), b = run(pieces, cradle_joints(), map, 100);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (size_t i = 0; i < a.blocks.size(); ++i) {
    ASSERT_EQ(a.blocks[i].segment_count, b.blocks[i].segment_count);
    for (int k = 0; k < a.blocks[i].segment_count; ++k)
      EXPECT_TRUE(
          same(a.blocks[i].segments[static_cast<size_t>(k)], b.blocks[i].segments[static_cast<size_t>(k)]));
  }
}

TEST(SpeedPlanner, AShortHorizonCostsLittle) {
  std::mt19937_64 rng(8);
  const auto pieces = blended(random_vertices(rng, 150, 4, 0), 0.5);
  const IdentityMap map({kX, kY, kZ});
  SpeedOptions far = full_shares();
  far.window_s = 20;
  const Planned near_run = run(pieces, linear_joints(3), map, 150, full_shares()),
                far_run = run(pieces, linear_joints(3), map, 150, far);
  EXPECT_GT(near_run.stats.windows, 3 * far_run.stats.windows);
  EXPECT_LE(near_run.stats.time_s, 1.01 * far_run.stats.time_s);
}

TEST(SpeedPlanner, FeedStepsAreMetBeforehand) {
  const IdentityMap map({kX});
  const Joints joints = linear_joints(1);
  Collector out;
  SpeedPlanner planner(joints, map, full_shares(), out);
  const double feeds[] = {200, 20, 300, 5};
  for (int i = 0; i < 4; ++i)
    planner.piece(
        plan(make_line(along_x(20 * i), along_x(20 * (i + 1))), feeds[i], i == 3, static_cast<unsigned>(i)));
  planner.finish();
  expect_within_limits(judge(out.blocks, map, joints, kDense));
  for (const MotionBlock& b : out.blocks)
    for (int k = 0; k < b.segment_count; ++k)
      for (int i = 0; i <= 8; ++i) {
        const TimeSegment& g = b.segments[static_cast<size_t>(k)];
        EXPECT_LE(g.v_at(g.duration_s * i / 8), feeds[b.source.line] * 1.000001);
      }
}

TEST(SpeedPlanner, EventsKeepTheirPlace) {
  const IdentityMap map({kX});
  const Joints joints = linear_joints(1);
  Collector out;
  SpeedPlanner planner(joints, map, {}, out);
  planner.piece(plan(make_line(along_x(0), along_x(1)), 100, true, 1));
  planner.event({QueueEvent::Kind::kDwell, 0.5, 0}, {2, 0});
  planner.piece(plan(make_line(along_x(1), along_x(2)), 100, true, 3));
  planner.finish();
  ASSERT_GE(out.blocks.size(), 3u);
  size_t events = 0;
  for (size_t i = 0; i < out.blocks.size(); ++i) {
    if (out.blocks[i].segment_count > 0) continue;
    ++events;
    EXPECT_EQ(out.blocks[i].event.kind, QueueEvent::Kind::kDwell);
    EXPECT_EQ(out.blocks[i].source.line, 2u);
    EXPECT_EQ(out.blocks[i - 1].source.line, 1u);
    EXPECT_TRUE(out.blocks[i - 1].ends_at_rest);
    EXPECT_EQ(out.blocks[i + 1].source.line, 3u);
  }
  EXPECT_EQ(events, 1u);
}

TEST(SpeedPlanner, LeavingTheRangeNamesJointValueLimitAndLine) {
  const IdentityMap map({kX});
  Joints joints = linear_joints(1);
  joints[0].limit.max = 50;
  Collector out;
  SpeedPlanner planner(joints, map, {}, out);
  planner.piece(plan(make_line(along_x(0), along_x(40)), 100, false, 7));
  try {
    planner.piece(plan(make_line(along_x(40), along_x(60)), 100, true, 8));
    FAIL();
  } catch (const ProgramError& e) {
    const std::string what = e.what();
    EXPECT_NE(what.find("line 8"), std::string::npos) << what;
    EXPECT_NE(what.find("joint X"), std::string::npos) << what;
    EXPECT_NE(what.find("50.0000 mm"), std::string::npos) << what;
  }
}

TEST(SpeedPlanner, ZeroFeedIsRefused) {
  const IdentityMap map({kX});
  const Joints joints = linear_joints(1);
  Collector out;
  SpeedPlanner planner(joints, map, {}, out);
  EXPECT_THROW(planner.piece(plan(make_line(along_x(0), along_x(1)), 0, true)), ProgramError);
}

// A wavy line in 20 000 pieces of 1e-3 mm: the pieces must not be felt.
TEST(SpeedPlanner, ManyTinyPiecesRunAsOne) {
  const IdentityMap map({kX, kY});
  const Joints joints = linear_joints(2);
  const auto point = [](double s) {
    PathPoint p;
    p.y = p.d1 = p.d2 = p.d3 = Words::Zero();
    p.y << s, std::sin(s), 0, 0, 0, 0;
    p.d1 << 1, std::cos(s), 0, 0, 0, 0;
    p.d2 << 0, -std::sin(s), 0, 0, 0, 0;
    p.d3 << 0, -std::cos(s), 0, 0, 0, 0;
    return p;
  };
  const auto in_pieces = [&](double size) {
    std::vector<PathPiece> pieces;
    for (int i = 0; i < static_cast<int>(20 / size + 0.5); ++i)
      pieces.push_back(make_hermite(point(i * size), point((i + 1) * size), size));
    return pieces;
  };
  const Planned fine = run(in_pieces(1e-3), joints, map, 100, full_shares()),
                coarse = run(in_pieces(0.2), joints, map, 100, full_shares());
  const Verdict v = judge(fine.blocks, map, joints, kDense, 100);
  expect_within_limits(v);
  EXPECT_EQ(fine.stats.fallbacks, 0u);
  EXPECT_NEAR(fine.stats.time_s, coarse.stats.time_s, 0.01 * coarse.stats.time_s);
}

}  // namespace
}  // namespace trn::speed_test
