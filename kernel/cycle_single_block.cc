#include "kernel/cycle.h"

// Single block: the machine stands at the end of every line.
namespace trn {

namespace {
constexpr double kLineEndS = 1e-6;           // of plan time before the end of a line: there
constexpr std::uint64_t kLineBlocks = 1024;  // are looked at for the end of a line
}  // namespace

// The block that motion goes on with: the front, or the next one where the front is as good as done.
const MotionBlock* Cycle::block_here(std::uint64_t& index) TRN_RT {
  index = 0;
  const MotionBlock* front = queue_.front();
  if (!front || front->segment_count == 0 || interpolator_.at_rest()) return front;
  const PlanPlace place = interpolator_.place();
  double left = -place.time_s;
  for (int k = place.segment; k < front->segment_count; ++k)
    left += front->segments[static_cast<std::size_t>(k)].duration_s;
  if (left > kLineEndS || front->ends_at_rest) return front;
  return queue_.ahead(++index);
}

// Single block: true if the machine stands at the end of the line that was released.
bool Cycle::pause_between_lines() TRN_RT {
  std::uint64_t index = 0;
  const MotionBlock* here = block_here(index);
  if (!single_block_ || !here) return false;
  if (step_begins_) {
    step_begins_ = false;
    step_line_ = here->line;
    step_number_ = queue_.number_ahead(index);
  }
  if (dwell_left_s_ > 0 || !(path_rate_.standing() || interpolator_.at_rest())) return false;
  if (queue_.number_ahead(index) <= step_number_ || here->line == step_line_) return false;
  motion_ = MotionState::kPaused;
  return true;
}

// Single block: plan time to the end of the released line, if that is in the middle of a stretch and near.
double Cycle::way_to_line_end() TRN_RT {
  if (!single_block_ || interpolator_.at_rest() || stopping_) return PathRate::kNoStop;
  const PlanPlace place = interpolator_.place();
  double way = -place.time_s;
  for (std::uint64_t i = 0; i < kLineBlocks && way < path_rate_.stop_horizon_s(); ++i) {
    const MotionBlock* block = queue_.ahead(i);
    if (!block || block->segment_count == 0) return PathRate::kNoStop;
    if (queue_.number_ahead(i) > step_number_ && block->line != step_line_) return std::max(way, 0.0);
    for (int k = i > 0 ? 0 : place.segment; k < block->segment_count; ++k)
      way += block->segments[static_cast<std::size_t>(k)].duration_s;
    if (block->ends_at_rest) return PathRate::kNoStop;
  }
  return PathRate::kNoStop;
}

// Single block: the released line ended too soon to stop there; the one that has begun takes its place.
void Cycle::release_line_passed() TRN_RT {
  const MotionBlock* front = queue_.front();
  if (!single_block_ || !front || front->segment_count == 0 || front->line == step_line_) return;
  if (queue_.number_ahead(0) <= step_number_ || interpolator_.place().time_s < kLineEndS) return;
  step_line_ = front->line;
  step_number_ = queue_.number_ahead(0);
}

}  // namespace trn
