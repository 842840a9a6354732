#pragma once

#include "interp/plan/lanes.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/speed_problem.h"

namespace trn::speed {

/// Motion of the path parameter at one moment.
struct PathState {
  double s = 0, v = 0, a = 0;
};

/// Constant jerk from `from` for `duration_s`, over the grid's intervals [first, last).
struct LawSegment {
  PathState from;
  double jerk = 0, duration_s = 0;
  size_t first = 0, last = 0;  ///< indices into the grid

  PathState at(double t) const {
    return {from.s + t * (from.v + t * (from.a / 2 + t * (jerk / 6))), from.v + t * (from.a + t * (jerk / 2)),
            from.a + t * jerk};
  }
  PathState end() const { return at(duration_s); }
  /// Time in [0, duration] at which the parameter passes s.
  double time_at(double s) const;
  /// The same, to `accuracy` as a share of the duration.
  double time_at(double s, double accuracy) const;
};

/// Turns the solution c of `problem` on grid[first, ...) into segments of constant jerk, one an interval, and
/// appends them to `law`. s is exact at every node; a is the solution's plus a small correction that keeps v
/// near the solution's. `from` is the true state at the first node. At the last node a = -2/3 v^2 /
/// rest_length holds exactly, so that constant jerk leads from there to rest. False: v would not stay
/// positive.
bool make_time_law(const std::deque<GridInterval>& grid, size_t first, const SpeedProblem& problem,
                   const Doubles& c, PathState from, double rest_length, std::vector<LawSegment>& law);

/// Constant jerk from rest over the intervals [first, last) of the grid, up to b = b_end at their end.
LawSegment rest_start(const std::deque<GridInterval>& grid, size_t first, size_t last, double b_end);
/// Constant jerk from the state `from` to rest at the end of the intervals [first, last); its acceleration at
/// the start is the one that fits, -2/3 v^2 / length, whatever from.a.
LawSegment rest_stop(const std::deque<GridInterval>& grid, size_t first, size_t last, const PathState& from);

}  // namespace trn::speed
