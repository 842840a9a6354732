#pragma once

#include "core/motion.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/time_law.h"

namespace trn::speed {

/// The joints' motion while the law runs from `from_s` to `to_s` of the segment's own time (s), from the
/// samples of its intervals, interpolated by parabolas. `rates`: the joints' full limits.
JointMotion joint_motion(const LawSegment& segment, const std::deque<GridInterval>& grid,
                         const JointRates& rates, double from_s, double to_s);

}  // namespace trn::speed
