#include "interp/plan/speed/block_emitter.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/motion.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/grid_support.h"

namespace trn::speed_test {
namespace {

/// Pieces of these lengths along X under two segments of 1 mm each, at 10 mm/s.
std::vector<MotionBlock> emit(const std::vector<double>& lengths, size_t output_of = 99) {
  const auto grid = make_grid({1.0, 1.0}, [](double) { return straight_sample(1e4); });
  Collector out;
  speed::BlockEmitter emitter(speed::joint_rates(linear_joints(1), 1, 1), out);
  emitter.begin_stretch();
  double s = 0;
  for (size_t i = 0; i < lengths.size(); ++i) {
    Words from = Words::Zero(), to = Words::Zero();
    to[kX] = lengths[i];  // where a piece lies does not matter here, and 1e-16 behind 1 would be no length
    PlanPiece piece = plan(make_line(from, to), 10, false, static_cast<std::uint32_t>(i + 1));
    if (i == output_of) piece.outputs.put(5, true);
    emitter.add_piece(piece, s);
    s += lengths[i];
  }
  emitter.segment({{0, 10, 0}, 0, 0.1, 0, 1}, grid, false);
  emitter.segment({{1, 10, 0}, 0, 0.1, 1, 2}, grid, true);
  EXPECT_EQ(emitter.block_count(), out.blocks.size());
  return out.blocks;
}

// Segments are cut where pieces meet; s begins anew in each piece, and no time is lost.
TEST(BlockEmitter, CutsSegmentsAtTheBordersOfPieces) {
  const auto blocks = emit({0.4, 1.1, 0.5});
  ASSERT_EQ(blocks.size(), 3u);
  const std::vector<std::vector<double>> durations{{0.04}, {0.06, 0.05}, {0.05}};
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(blocks[i].segment_count, durations[i].size());
    for (size_t k = 0; k < durations[i].size(); ++k)
      EXPECT_NEAR(blocks[i].segments[k].duration_s, durations[i][k], 1e-12);
    EXPECT_NEAR(blocks[i].segments[0].s, 0, 1e-12);
    EXPECT_EQ(blocks[i].source.line, i + 1);
    EXPECT_EQ(blocks[i].ends_at_rest, i == 2);
  }
}

// A border that coincides with a segment's end leaves no segment of no length behind.
TEST(BlockEmitter, ABorderAtASegmentsEndCutsNothing) {
  const auto blocks = emit({1.0, 1.0});
  ASSERT_EQ(blocks.size(), 2u);
  for (const MotionBlock& b : blocks) EXPECT_EQ(b.segment_count, 1);
}

// Outputs act once, with the first block of their piece; if no time is left for it, with the next piece.
TEST(BlockEmitter, OutputsActOnceWhereTheirPieceBegins) {
  const auto blocks = emit({0.4, 1.1, 0.5}, 1);
  EXPECT_FALSE(blocks[0].outputs.any());
  EXPECT_TRUE(blocks[1].outputs.any());
  EXPECT_FALSE(blocks[2].outputs.any());
  const auto vanished = emit({1.0, 1e-16, 1.0}, 1);
  ASSERT_EQ(vanished.size(), 2u);
  EXPECT_TRUE(vanished[1].outputs.any());
}

}  // namespace
}  // namespace trn::speed_test
