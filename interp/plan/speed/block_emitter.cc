#include "interp/plan/speed/block_emitter.h"

#include <cmath>
#include <utility>

#include "core/check.h"

namespace trn::speed {

namespace {

OutputChanges join(OutputChanges first, const OutputChanges& later) {
  first.add(later);
  return first;
}

}  // namespace

void BlockEmitter::begin_stretch() { pieces_.clear(); }

void BlockEmitter::add_piece(const PlanPiece& piece, double s_start) { pieces_.push_back({piece, s_start}); }

// A border of pieces may lie inside of the segment, or within rounding of its end: then the piece ends with
// the segment, rather than leave a rest of no length. A piece so short that no time is left for it passes its
// outputs on.
void BlockEmitter::segment(const LawSegment& segment, const std::deque<GridInterval>& grid, bool at_rest) {
  const double s_end = segment.end().s;
  double t = 0;
  while (pieces_.size() > 1) {
    const double border = pieces_[1].s, tolerance = 1e-9 * pieces_[0].plan.piece.length;
    if (s_end < border - tolerance) break;
    const double t_border =
        s_end > border + 1e-9 * pieces_[1].plan.piece.length ? segment.time_at(border) : segment.duration_s;
    if (t_border > t) append(segment, grid, t, t_border);
    t = t_border;
    flush(at_rest && t >= segment.duration_s);
    const OutputChanges left = pieces_[0].plan.outputs;
    pieces_.pop_front();
    if (left.any()) pieces_[0].plan.outputs = join(left, pieces_[0].plan.outputs);
  }
  if (t < segment.duration_s) append(segment, grid, t, segment.duration_s);
  if (at_rest) flush(true);
}

void BlockEmitter::append(const LawSegment& segment, const std::deque<GridInterval>& grid, double from_s,
                          double to_s) {
  TRN_CHECK(to_s > from_s && from_s >= 0);
  TRN_CHECK(!pieces_.empty());
  if (block_.segment_count == MotionBlock::kMaxSegments) flush(false);
  const PathState from = segment.at(from_s);
  TRN_CHECK(block_.segment_count < MotionBlock::kMaxSegments);
  TRN_CHECK(std::isfinite(from.v) && std::isfinite(from.a));
  block_.joints[block_.segment_count] = joint_motion(segment, grid, rates_, from_s, to_s);
  block_.segments[block_.segment_count++] = {to_s - from_s, from.s - pieces_.front().s, from.v, from.a,
                                             segment.jerk};
}

void BlockEmitter::flush(bool at_rest) {
  if (block_.segment_count == 0) return;
  PlanPiece& plan = pieces_.front().plan;
  TRN_CHECK(plan.piece.length > 0);
  block_.outputs = std::exchange(plan.outputs, {});
  block_.piece = plan.piece;
  block_.context = plan.context;
  block_.rapid = plan.rapid;
  block_.overrides = plan.feed.overrides;
  block_.source = plan.source;
  block_.ends_at_rest = at_rest;
  out_.block(block_);
  ++block_count_;
  block_.segment_count = 0;
}

void BlockEmitter::event(const QueueEvent& event, SourceLine source) {
  TRN_CHECK(block_.segment_count == 0);
  TRN_CHECK(event.kind != QueueEvent::Kind::kNone);
  MotionBlock block{};
  block.event = event;
  block.overrides = event.overrides;
  block.source = source;
  block.ends_at_rest = true;
  out_.block(block);
  ++block_count_;
}

}  // namespace trn::speed
