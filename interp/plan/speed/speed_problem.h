#pragma once

#include <vector>

#include "interp/plan/speed/path_grid.h"

namespace trn::speed {

using Doubles = std::vector<double>;

/// How a plan meets its first or last node. At rest, `rest_length` of path is left to or from the standstill
/// and is covered at constant jerk, so that a = +-2/3 b / rest_length there; otherwise the state is given.
struct PlanEnd {
  bool at_rest = true;
  double rest_length = 0;  ///< at rest; > 0
  double b_max = 0;        ///< at rest: greatest b at the node for which the constant jerk keeps all limits
  SpeedState state;        ///< moving
};

/// The problem of the fastest time law on N intervals of a grid.
///
/// Unknown: b(s) = (ds/dt)^2 as a quadratic spline (C1, so a = b'/2 is continuous and linear on an interval);
/// its coefficients c_k belong to the intervals (the value where the tangents at the interval's ends meet, so
/// the spline stays inside their hull). At node k: b = b0 c_{k-1} + b1 c_k, a = a0 c_{k-1} + a1 c_k. Rows,
/// each for one joint, scaled to its limit:
///   node k:      | (q' a + q'' b) |                  <= 1
///   interval k:  | q' a' + 3 q'' a + q''' b | = |jerk| / v <= 1 / v,   at both ends, with v = sqrt(c_k)
///   interval k:  c_k <= c_max
/// The time law has constant d3s/dt3 on an interval, so the jerk row is calibrated by the speeds of an
/// expected solution: mean speed over sqrt(c_k), and the speeds at both ends over the mean. All left sides
/// are linear in c; 1 / sqrt(c) is convex, so replacing it by its tangent stays on the safe side.
struct SpeedProblem {
  int intervals = 0, joints = 0;
  bool first_fixed = false;                    ///< moving start: c_0 follows from the state
  Doubles h, c_max, jerk_scale;                ///< per interval
  Doubles node_b0, node_b1, node_a0, node_a1;  ///< per node, intervals + 1
  Doubles acc0, acc1;                          ///< [joint][node]
  Doubles jerk0, jerk1, jerk2;                 ///< [2 joint + end][interval], on c_{k-1}, c_k, c_{k+1}
  double first_c = 0;

  SpeedState at_node(const Doubles& c, int node) const;
};

/// How much of the limits the solver may use, per interval of the grid; lowered where verification asks.
struct Headroom {
  double velocity = 1, acceleration = 1, jerk = 1;
};

/// Sets up the problem on grid[first, first + n). `expected`: about the solution, one c per interval.
void build_problem(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const PlanEnd& start, const PlanEnd& end,
                   const Doubles& expected, SpeedProblem& problem);

}  // namespace trn::speed
