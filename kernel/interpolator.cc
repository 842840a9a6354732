#include "kernel/interpolator.h"

#include <utility>

#include "core/check.h"

namespace trn {

Interpolator::Outcome Interpolator::advance(double plan_time_s) TRN_RT {
  TRN_CHECK(plan_time_s > 0);
  TRN_CHECK(segment_ >= 0 && time_s_ >= 0);
  time_s_ += plan_time_s;
  for (int blocks = 0; blocks < kBlocksPerTick; ++blocks) {
    const MotionBlock* block = queue_.front();
    // What stops has a period for its end: the drives are told the very place, a hole its whole depth, and
    // where the next stretch reads the words in another way, both ends are seen.
    if (block && blocks > 0 && at_rest_) {
      time_s_ = 0;
      return Outcome::kMoving;
    }
    if (!block || block->segment_count == 0) {
      time_s_ = 0;
      if (!has_position_) look_for_context();
      if (block) return Outcome::kAtEvent;
      return at_rest_ ? Outcome::kAtRest : Outcome::kStarved;
    }
    begin_front(*block);
    TRN_CHECK(block->segment_count <= MotionBlock::kMaxSegments);
    while (segment_ < block->segment_count) {
      const double duration = block->segments[static_cast<std::size_t>(segment_)].duration_s;
      if (time_s_ < duration) {
        evaluate(*block);
        return Outcome::kMoving;
      }
      time_s_ -= duration;
      ++segment_;
    }
    // Past its end: stand there, in case nothing follows yet.
    --segment_;
    const double rest = time_s_;
    time_s_ = block->segments[static_cast<std::size_t>(segment_)].duration_s;
    evaluate(*block);
    at_rest_ = block->ends_at_rest;
    time_s_ = rest;
    segment_ = 0;
    queue_.pop();
    begun_ = false;
  }
  return Outcome::kBroken;
}

void Interpolator::begin_front(const MotionBlock& block) TRN_RT {
  queue_.begin_front();
  if (!begun_ && block.outputs.any()) outputs_.add(block.outputs);
  begun_ = true;
}

// A machine that waits for the program's first motion is described as that will be.
void Interpolator::look_for_context() TRN_RT {
  for (std::uint64_t i = 0; i < kBlocksPerTick; ++i) {
    const MotionBlock* block = queue_.ahead(i);
    if (!block) return;
    if (block->segment_count == 0) continue;
    context_ = block->context;
    return;
  }
}

OutputChanges Interpolator::take_outputs() TRN_RT { return std::exchange(outputs_, {}); }

bool Interpolator::skip_to_event() TRN_RT {
  time_s_ = 0;
  segment_ = 0;
  at_rest_ = true;
  begun_ = false;
  for (int blocks = 0; blocks < kBlocksPerTick; ++blocks) {
    const MotionBlock* block = queue_.front();
    if (!block) return false;
    if (block->segment_count == 0) return true;
    queue_.pop();
  }
  return false;
}

void Interpolator::evaluate(const MotionBlock& block) TRN_RT {
  TRN_CHECK(segment_ < block.segment_count);
  y_ = block.piece.at(block.segments[static_cast<std::size_t>(segment_)].s_at(time_s_));
  TRN_CHECK(y_.allFinite());
  context_ = block.context;
  overrides_ = block.overrides;
  source_ = block.source;
  at_rest_ = false;
  has_position_ = true;
}

Interpolator::Stand Interpolator::stand() const TRN_RT {
  return {time_s_, segment_, at_rest_, begun_, y_, context_, overrides_, source_};
}

void Interpolator::return_to(const Stand& stand) TRN_RT {
  time_s_ = stand.time_s;
  segment_ = stand.segment;
  at_rest_ = stand.at_rest;
  begun_ = stand.begun;
  y_ = stand.y;
  context_ = stand.context;
  overrides_ = stand.overrides;
  source_ = stand.source;
}

void Interpolator::go_to(const PlanPlace& place, const MotionBlock& block) TRN_RT {
  TRN_CHECK(place.segment >= 0 && place.segment < block.segment_count && place.time_s >= 0);
  time_s_ = place.time_s;
  segment_ = place.segment;
  begun_ = true;
  evaluate(block);
}

void Interpolator::abandon() TRN_RT {
  queue_.drop_all();
  time_s_ = 0;
  segment_ = 0;
  at_rest_ = true;
  begun_ = false;
  outputs_ = {};
  has_position_ = false;  // the joints may go elsewhere before the next program
}

}  // namespace trn
