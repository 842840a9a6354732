#pragma once

#include "interp/plan/speed/time_law.h"

namespace trn::speed {

/// Greatest share of the limits that a segment uses.
struct LimitUse {
  double velocity_squared = 0, acceleration = 0, jerk = 0;  ///< the first: b / b_max, feed included
};

/// Of the segment at the judged places of one of its intervals. Keeps in the interval what the next call
/// needs again.
LimitUse limit_use(const LawSegment& segment, GridInterval& interval, const JointRates& rates);

/// Greatest b at the moving end of the rest segment over [first, last) that keeps all limits.
double rest_bound(const std::deque<GridInterval>& grid, size_t first, size_t last, const JointRates& rates,
                  const std::deque<Headroom>& headroom, bool start);

}  // namespace trn::speed
