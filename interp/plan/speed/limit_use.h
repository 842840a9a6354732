#pragma once

#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/speed_problem.h"
#include "interp/plan/speed/time_law.h"

namespace trn::speed {

/// Greatest share of the limits that a segment uses.
struct LimitUse {
  double velocity_squared = 0, acceleration = 0, jerk = 0;  ///< the first: b / b_max, feed included
};

/// Use of the segment in one of its intervals: at the samples, and at a third and two thirds between them by
/// parabolas. Keeps these in the interval for the next call.
LimitUse limit_use(const LawSegment& segment, GridInterval& interval, const JointRates& rates);

/// Greatest b = (ds/dt)^2 at the moving end of the rest segment over [first, last) that keeps all limits
/// times their headroom at the samples. `start`: the segment begins at rest; else it ends there.
double rest_bound(const std::deque<GridInterval>& grid, size_t first, size_t last, const JointRates& rates,
                  const std::deque<Headroom>& headroom, bool start);

}  // namespace trn::speed
