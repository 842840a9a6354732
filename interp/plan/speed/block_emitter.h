#pragma once

#include <deque>

#include "core/motion.h"
#include "interp/plan/speed/joint_motion.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/time_law.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// Cuts the segments of the time law at the borders of pieces and packs them into MotionBlocks, in order,
/// each segment with the motion of the joints in it.
class BlockEmitter {
 public:
  /// `rates`: the joints' full limits.
  BlockEmitter(const JointRates& rates, BlockSink& out) : rates_(rates), out_(out) {}

  void begin_stretch();
  void add_piece(const PlanPiece& piece, double s_start);
  /// The next segment of the law. `grid`: the intervals that its indices mean. `at_rest`: it ends at rest.
  void segment(const LawSegment& segment, const std::deque<GridInterval>& grid, bool at_rest);
  void event(const QueueEvent& event, SourceLine source);

  size_t piece_count() const { return pieces_.size(); }
  std::uint64_t block_count() const { return block_count_; }

 private:
  struct Placed {
    PlanPiece plan;
    double s;
  };
  void append(const LawSegment& segment, const std::deque<GridInterval>& grid, double from_s, double to_s);
  void flush(bool at_rest);

  JointRates rates_;
  BlockSink& out_;
  std::deque<Placed> pieces_;
  MotionBlock block_;
  std::uint64_t block_count_ = 0;
};

}  // namespace trn::speed
