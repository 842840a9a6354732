#include <gtest/gtest.h>
#include <malloc.h>

#include <ctime>

#include "core/axes.h"
#include "core/motion.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_planner.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

// A long program: what the planner holds does not grow with it, and the first block comes soon.
namespace trn::speed_test {
namespace {

double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Notes how much memory is in use whenever a block comes, and when the first one did.
struct Watch : BlockSink {
  void block(const MotionBlock& block) override {
    if (blocks++ == 0) first_s = processor_s();
    for (std::size_t i = 0; i < block.segment_count; ++i) time_s += block.segments[i].duration_s;
    in_use = std::max(in_use, mallinfo2().uordblks);
  }
  std::size_t blocks = 0, in_use = 0;
  double first_s = 0, time_s = 0;
};

/// Five-axis passes of 0.1 mm chords over a wavy surface, in one stretch.
ProgramMove surface_move(int i, const Words& from) {
  const double t = 0.1 * i;
  ProgramMove m;
  m.kind = ProgramMove::Kind::kFeed;
  m.from = from;
  m.to = Words::Zero();
  m.to.head<3>() << 40 * std::sin(t / 40), 30 * std::cos(t / 47), 3 * std::sin(t / 9);
  m.to[kA] = 0.3 + 0.1 * std::sin(t / 30);
  m.to[kC] = 0.4 * std::cos(t / 50);
  for (double& x : m.to.reshaped()) x = std::round(x * 1e4) / 1e4;
  m.context.rtcp = true;
  m.feed.tip_mm_s = 100;
  m.tolerance_mm = 0.01;
  m.tolerance_rad = 0.002;
  m.source.line = static_cast<std::uint32_t>(i);
  return m;
}

TEST(PlannerMemory, IsBoundedAndTheFirstBlockComesSoon) {
  const int moves = 40'000 * test::rounds(1, 100);
  const TrunnionMap map;
  const Joints joints = cradle_joints();
  Watch out;
  SpeedPlanner speed(joints, map, full_shares(), out);
  GeometryPlanner geometry({}, speed);
  const double begin_s = processor_s();
  Words at = surface_move(0, Words::Zero()).to;
  std::size_t early = 0;
  for (int i = 1; i <= moves; ++i) {
    const ProgramMove move = surface_move(i, at);
    geometry.move(move);
    at = move.to;
    if (i == moves / 4) early = std::exchange(out.in_use, 0);
  }
  const std::size_t late = out.in_use;
  geometry.finish();
  speed.finish();
  std::printf(
      "%d moves, %zu blocks; in use %.1f MB in the first quarter, %.1f MB after; first block after %.0f ms\n",
      moves, out.blocks, 1e-6 * static_cast<double>(early), 1e-6 * static_cast<double>(late),
      1e3 * (out.first_s - begin_s));
  EXPECT_GT(out.blocks, 1000u);
  EXPECT_LT(static_cast<double>(late), 1.1 * static_cast<double>(early) + 1e6);
  EXPECT_LT(late, 64u << 20);
  EXPECT_LT(out.first_s - begin_s, 0.2);
}

// A move of hours at one feed: its plan is no larger than that of one of minutes, whatever the feed.
TEST(PlannerMemory, AMoveOfHoursCostsNoMoreThanItsEnds) {
  const TrunnionMap map;
  const Joints joints = cradle_joints();
  for (const double feed_mm_s : {0.02, 1e-3, 1e-5}) {
    for (const double c : {0.0, 2.0}) {
      Watch out;
      SpeedPlanner speed(joints, map, full_shares(), out);
      GeometryPlanner geometry({}, speed);
      ProgramMove move = surface_move(1, Words::Zero());
      move.from = move.to;
      move.to[kX] += 40;
      move.to[kC] += c;
      move.feed.tip_mm_s = feed_mm_s;
      geometry.move(move);
      geometry.finish();
      speed.finish();
      EXPECT_LT(out.in_use, 96u << 20) << feed_mm_s;
      EXPECT_LT(out.blocks, 30000u) << feed_mm_s;
      EXPECT_NEAR(out.time_s, 40 / feed_mm_s, 1e-3 * 40 / feed_mm_s + 3) << c;
    }
  }
}

}  // namespace
}  // namespace trn::speed_test
