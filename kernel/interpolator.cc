#include "kernel/interpolator.h"

#include <utility>

#include "core/check.h"

namespace trn {

Interpolator::Outcome Interpolator::advance(double plan_time_s) TRN_RT {
  TRN_CHECK(plan_time_s > 0);
  TRN_CHECK(at_.segment >= 0 && at_.time_s >= 0);
  at_.time_s += plan_time_s;
  for (int blocks = 0; blocks < kBlocksPerTick; ++blocks) {
    const MotionBlock* block = queue_.front();
    // What stops has a period for its end: the drives are told the very place, a hole its whole depth, and
    // where the next stretch reads the words in another way, both ends are seen.
    if (block && blocks > 0 && at_.at_rest) {
      at_.time_s = 0;
      return Outcome::kMoving;
    }
    if (!block || block->segment_count == 0) {
      at_.time_s = 0;
      if (!has_position_) look_for_context();
      if (block) return Outcome::kAtEvent;
      return at_.at_rest ? Outcome::kAtRest : Outcome::kStarved;
    }
    begin_front(*block);
    TRN_CHECK(block->segment_count <= MotionBlock::kMaxSegments);
    while (at_.segment < block->segment_count) {
      const double duration = block->segments[static_cast<std::size_t>(at_.segment)].duration_s;
      if (at_.time_s < duration) {
        evaluate(*block);
        return Outcome::kMoving;
      }
      at_.time_s -= duration;
      ++at_.segment;
    }
    // Past its end: stand there, in case nothing follows yet.
    --at_.segment;
    const double rest = at_.time_s;
    at_.time_s = block->segments[static_cast<std::size_t>(at_.segment)].duration_s;
    evaluate(*block);
    at_.at_rest = block->ends_at_rest;
    at_.time_s = rest;
    at_.segment = 0;
    queue_.pop();
    at_.begun = false;
  }
  return Outcome::kBroken;
}

void Interpolator::begin_front(const MotionBlock& block) TRN_RT {
  queue_.begin_front();
  if (!at_.begun && block.outputs.any()) outputs_.add(block.outputs);
  at_.begun = true;
}

// A machine that waits for the program's first motion is described as that will be.
void Interpolator::look_for_context() TRN_RT {
  for (std::uint64_t i = 0; i < kBlocksPerTick; ++i) {
    const MotionBlock* block = queue_.ahead(i);
    if (!block) return;
    if (block->segment_count == 0) continue;
    at_.context = block->context;
    return;
  }
}

OutputChanges Interpolator::take_outputs() TRN_RT { return std::exchange(outputs_, {}); }

bool Interpolator::skip_to_event() TRN_RT {
  at_.time_s = 0;
  at_.segment = 0;
  at_.at_rest = true;
  at_.begun = false;
  for (int blocks = 0; blocks < kBlocksPerTick; ++blocks) {
    const MotionBlock* block = queue_.front();
    if (!block) return false;
    if (block->segment_count == 0) return true;
    queue_.pop();
  }
  return false;
}

void Interpolator::evaluate(const MotionBlock& block) TRN_RT {
  TRN_CHECK(at_.segment < block.segment_count);
  at_.y = block.piece.at(block.segments[static_cast<std::size_t>(at_.segment)].s_at(at_.time_s));
  TRN_CHECK(at_.y.allFinite());
  at_.context = block.context;
  at_.overrides = block.overrides;
  at_.source = block.source;
  at_.at_rest = false;
  has_position_ = true;
}

void Interpolator::go_to(const PlanPlace& place, const MotionBlock& block) TRN_RT {
  TRN_CHECK(place.segment >= 0 && place.segment < block.segment_count && place.time_s >= 0);
  at_.time_s = place.time_s;
  at_.segment = place.segment;
  at_.begun = true;
  evaluate(block);
}

void Interpolator::abandon() TRN_RT {
  queue_.drop_all();
  at_.time_s = 0;
  at_.segment = 0;
  at_.at_rest = true;
  at_.begun = false;
  outputs_ = {};
  leave_path();  // the joints may go elsewhere before the next program
}

}  // namespace trn
