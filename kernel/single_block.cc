#include "kernel/single_block.h"

#include <algorithm>

#include "core/check.h"
#include "kernel/rate_plan.h"

namespace trn {

namespace {
constexpr double kLineEndS = 1e-6;           // of plan time before the end of a line: there
constexpr std::uint64_t kLineBlocks = 1024;  // are looked at for the end of a line
constexpr std::uint64_t kShortBlocks = 64;   // as good as done, at most
}  // namespace

void SingleBlock::set(bool on) TRN_RT {
  begins_ = begins_ || !on_;
  on_ = on;
}

// The block that motion goes on with: the front, or the next one that is not as good as done. A line may end
// with blocks that take less time than the stop before it leaves.
const MotionBlock* SingleBlock::block_here(std::uint64_t& index) const TRN_RT {
  index = 0;
  const MotionBlock* block = queue_.front();
  if (!block || interpolator_.at_rest()) return block;
  const PlanPlace place = interpolator_.place();
  double left_s = -place.time_s;
  for (int first = place.segment; block && block->segment_count > 0; first = 0) {
    for (int k = first; k < block->segment_count; ++k)
      left_s += block->segments[static_cast<std::size_t>(k)].duration_s;
    if (left_s > kLineEndS || block->ends_at_rest || index == kShortBlocks) return block;
    block = queue_.ahead(++index);
  }
  return block;
}

bool SingleBlock::pauses(bool stands) TRN_RT {
  if (!holds()) return false;
  std::uint64_t index = 0;
  const MotionBlock* here = block_here(index);
  if (!here) return false;
  if (begins_) {
    begins_ = false;
    line_ = here->source.line;
    number_ = queue_.number_ahead(index);
  }
  return stands && queue_.number_ahead(index) > number_ && here->source.line != line_;
}

double SingleBlock::to_line_end_s(double horizon_s) const TRN_RT {
  if (!holds() || interpolator_.at_rest()) return RateWish::kNoStop;
  const PlanPlace place = interpolator_.place();
  double way_s = -place.time_s;
  TRN_CHECK(place.time_s >= 0);
  for (std::uint64_t i = 0; i < kLineBlocks && way_s < horizon_s; ++i) {
    const MotionQueue::Ahead ahead = queue_.look_ahead(i);
    if (!ahead.block || ahead.block->segment_count == 0) return RateWish::kNoStop;
    if (ahead.number > number_ && ahead.block->source.line != line_) return std::max(way_s, 0.0);
    way_s += ahead.duration_s;
    for (int k = 0; i == 0 && k < place.segment; ++k)
      way_s -= ahead.block->segments[static_cast<std::size_t>(k)].duration_s;
    if (ahead.block->ends_at_rest) return RateWish::kNoStop;
  }
  return RateWish::kNoStop;
}

void SingleBlock::pass_line() TRN_RT {
  if (!holds()) return;
  const MotionBlock* front = queue_.front();
  if (!front || front->segment_count == 0 || front->source.line == line_) return;
  if (queue_.number_ahead(0) <= number_ || interpolator_.place().time_s < kLineEndS) return;
  line_ = front->source.line;
  TRN_CHECK(queue_.number_ahead(0) > number_);
  number_ = queue_.number_ahead(0);
}

}  // namespace trn
