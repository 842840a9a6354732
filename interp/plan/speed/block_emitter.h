#pragma once

#include <deque>

#include "interp/plan/speed/time_law.h"

namespace trn::speed {

/// Cuts time-law segments at the borders of pieces and packs them into motion blocks, in order.
class BlockEmitter {
 public:
  explicit BlockEmitter(BlockSink& out) : out_(out) {}

  void begin_stretch();
  void add_piece(const PlanPiece& piece, double s_start);
  /// `at_rest`: the segment ends standing still.
  void segment(const LawSegment& segment, bool at_rest);
  void event(const QueueEvent& event, std::uint32_t line);

  size_t piece_count() const { return pieces_.size(); }
  std::uint64_t block_count() const { return block_count_; }

 private:
  struct Placed {
    PlanPiece plan;
    double s;
  };
  void append(const PathState& from, double jerk, double duration_s);
  void flush(bool at_rest);

  BlockSink& out_;
  std::deque<Placed> pieces_;
  MotionBlock block_;
  std::uint64_t block_count_ = 0;
};

}  // namespace trn::speed
