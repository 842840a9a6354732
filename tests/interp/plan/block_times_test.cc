#include "tests/app/session/block_times.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/speed/speed_planner.h"
#include "tests/interp/plan/block_clock.h"
#include "tests/interp/plan/speed_support.h"
#include "tests/support/rounds.h"

// A block takes the time that its feed asks for, or longer; also where a curve stands for many blocks.
namespace trn {
namespace {

using namespace speed_test;
using test::BlockClock;
using test::BlockTime;

struct Machine5 {
  const JointMap* map = nullptr;
  Joints joints = cradle_joints();
};

std::vector<BlockTime> times_of(const std::vector<ProgramMove>& moves, const Machine5& machine) {
  Collector out;
  SpeedPlanner speed(machine.joints, *machine.map, full_shares(), out);
  GeometryPlanner geometry({}, speed);
  constexpr double kPeriod = 2.5e-4;
  BlockClock clock(kPeriod);
  for (const ProgramMove& move : moves) {
    geometry.move(move);
    clock.programmed(move);
  }
  geometry.finish();
  speed.finish();
  std::vector<JointVec> q(4);
  double due = 0;
  std::uint64_t rows = 0;
  for (const MotionBlock& b : out.blocks)
    for (int i = 0; i < b.segment_count; ++i) {
      const TimeSegment& g = b.segments[static_cast<size_t>(i)];
      for (; due < g.duration_s; due += kPeriod) {
        const Words y = b.piece.at(g.s_at(due));
        q.erase(q.begin());
        q.emplace_back();
        machine.map->map(y, b.context, q.back());
        Verdict verdict;
        if (++rows > 3) judge_differences(q, kPeriod, machine.joints, verdict);
        clock.sample(y, std::max({verdict.velocity, verdict.acceleration, verdict.jerk}));
      }
      due -= g.duration_s;
    }
  clock.sample(moves.back().to, 0);
  EXPECT_TRUE(clock.complete());
  return clock.blocks();
}

double uniform(std::mt19937_64& rng, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(rng);
}

// A pass whose way, turning and feeds change from block to block.
std::vector<ProgramMove> inverse_time_pass(std::mt19937_64& rng, const MapContext& context) {
  std::vector<ProgramMove> moves;
  Words at = Words::Zero();
  at[kA] = 0.4;
  const double step = std::exp(uniform(rng, std::log(0.1), std::log(3.0)));
  const double turn = rad_from_deg(uniform(rng, 0, 4)), feed = uniform(rng, 1, 15),
               spread = uniform(rng, 1, 2);
  const double wave = uniform(rng, 5, 40), phase = uniform(rng, 0, 6);
  double x = 0;
  for (int i = 0; i < 60; ++i) {
    ProgramMove move;
    move.kind = ProgramMove::Kind::kFeed;
    move.from = at;
    const double length = step * uniform(rng, 0.5, 1.5);
    x += length;
    at[kX] = x;
    at[kY] = 3 * std::sin(x / wave * 6);
    at[kA] += 0.3 * turn * std::cos(phase + x / wave) * length / step;
    at[kC] += turn * std::sin(x / wave) * length / step;
    move.to = at;
    move.context = context;
    move.duration_s = length / feed * std::pow(spread, uniform(rng, -1, 1));
    move.tolerance_mm = 0.01;
    move.tolerance_rad = rad_from_deg(0.1);
    move.source.line = static_cast<std::uint32_t>(i + 1);
    moves.push_back(move);
  }
  return moves;
}

// Where a place of the curve is early or late by a share of the tolerance, so is the border.
void expect_programmed_times(const std::vector<BlockTime>& blocks, std::uint64_t seed) {
  double programmed = 0, driven = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const BlockTime& b = blocks[i];
    programmed += b.programmed_s;
    driven += b.driven_s;
    const double unsure = 0.005 + 0.2 * b.tolerance / b.length;
    EXPECT_GE(b.driven_s, b.programmed_s * (1 - unsure) - 1e-4) << "seed " << seed << " line " << b.line;
    double worst = 0;
    for (std::size_t k = i > 0 ? i - 1 : 0; k < std::min(i + 2, blocks.size()); ++k)
      worst = std::max(worst, blocks[k].worst);
    if (worst > 0.5 || i == 0 || i + 1 == blocks.size()) continue;
    EXPECT_LE(b.driven_s, b.programmed_s * (1.02 + unsure) + 1e-4)
        << "seed " << seed << " line " << b.line << " worst " << worst;
  }
  EXPECT_GE(driven, programmed);
  if (std::getenv("TRN_SHOW_TIMES"))
    std::printf("seed %d: programmed %.3f s, driven %.4f of it\n", static_cast<int>(seed), programmed,
                driven / programmed);
}

TEST(BlockTimes, InverseTimeOnACurve) {
  static const IdentityMap words({kX, kY, kZ, kA, kC});
  static const TrunnionMap trunnion;
  const int trials = test::rounds(12);
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937_64 rng(static_cast<std::uint64_t>(trial));
    Machine5 machine;
    MapContext context;
    context.rtcp = trial % 2 == 0;
    machine.map = context.rtcp ? static_cast<const JointMap*>(&trunnion) : &words;
    expect_programmed_times(times_of(inverse_time_pass(rng, context), machine),
                            static_cast<std::uint64_t>(trial));
  }
}

}  // namespace
}  // namespace trn
