#pragma once

#include <vector>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/speed/path_grid.h"

namespace trn::speed {

/// How a plan meets its first or last node. At rest, `rest_length` of path is left to or from the standstill
/// and is covered at constant jerk, so that a = +-2/3 b / rest_length there; otherwise the state is given.
struct PlanEnd {
  bool at_rest = true;
  double rest_length = 0;  ///< at rest; > 0
  double b_max = 0;        ///< at rest: greatest b at the node for which the constant jerk keeps all limits
  SpeedState state;        ///< moving
};

/// Derivatives of one joint by s at a group of places, over the joint's limit.
struct AccelerationRow {
  Lanes d1, d2;
};
struct JerkRow {
  Lanes d1, d2, d3;
};

/// The problem of the fastest time law on N intervals of a grid: minimise P7 under P4, P5, P9 and P13 of
/// docs/planner.md.
///
/// Unknown: b(s) = (ds/dt)^2 as a quadratic spline (C1, so a = b'/2 is continuous and linear on an interval);
/// its coefficients c_k belong to the intervals (the value where the tangents at the interval's ends meet, so
/// the spline stays inside their hull). At node k: b = b0 c_{k-1} + b1 c_k, a = a0 c_{k-1} + a1 c_k. Rows,
/// each for one joint, scaled to its limit:
///   node k:      | q' a + q'' b | <= 1                                                        (P5)
///   interval k:  | q' a' + 3 q'' a + q''' b | = |jerk| / v <= 1 / v, both ends, v = sqrt(c_k)   (P9)
///   interval k:  c_k <= c_max, and at the ends  b_k <= dip (c_k + b_{k+1}),  b_{k+1} <= dip (c_k + b_k):
///                from 2 on, constant jerk could not cover the interval without standing still   (P4, P13)
/// The time law has constant d3s/dt3 on an interval, so the terms of the jerk rows are multiplied by speeds
/// over sqrt(c_k): the mean speed for the first, the end's own for the others. The solver follows these as it
/// goes.
struct SpeedProblem {
  size_t intervals = 0, joints = 0;  ///< joints: those that move
  std::vector<size_t> moving;        ///< which they are
  bool first_fixed = false;          ///< moving start: c_0 follows from the state
  double first_c = 0;
  Doubles h, c_max, dip;                       ///< per interval, padded to whole groups
  Doubles node_b0, node_b1, node_a0, node_a1;  ///< per node, padded
  std::vector<AccelerationRow> acceleration;   ///< [group of nodes][joint]
  std::vector<JerkRow> jerk;                   ///< [group of intervals][end][joint]

  SpeedState at_node(const Doubles& c, size_t node) const;
};

/// How much of the limits the solver may use, per interval of the grid; lowered where verification finds
/// excess.
struct Headroom {
  double velocity = 1, acceleration = 1, jerk = 1;
  double dip = 1.6;  ///< see SpeedProblem; below 2
  /// Of the last round: the logarithms of the excess of velocity, and of what it was lowered by for that.
  double velocity_excess = 0, velocity_lowered = 0;
};

/// The greatest c_k of interval k of grid[first, first + n) at full headroom, from (P4): the least b_max of
/// its samples and of the neighbours' at the nodes between, where a jump of the feed may lie.
double coefficient_bound(const std::deque<GridInterval>& grid, size_t first, size_t n, size_t k);

/// Sets up the problem on grid[first, first + n). `changed`, by interval of the grid: where the headroom has
/// changed since the problem was set up last, nothing else having changed; empty: all is new.
void build_problem(const std::deque<GridInterval>& grid, size_t first, size_t n, const JointRates& rates,
                   const std::deque<Headroom>& headroom, const PlanEnd& start, const PlanEnd& end,
                   const std::vector<bool>& changed, SpeedProblem& problem);

}  // namespace trn::speed
