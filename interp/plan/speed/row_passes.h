#pragma once

#include <array>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/speed_problem.h"

namespace trn::speed {

/// Slack and multiplier of inequalities g(x) + slack = 0 at a group of samples, and the step found for them.
struct RowState {
  Lanes slack, dual, slack_step, dual_step;
};
/// Both sides of |value| <= room.
using TwoSided = std::array<RowState, 2>;

/// What the interior-point method works on. Intervals and nodes are padded to whole groups of lanes; the
/// padding keeps every row and changes nothing.
struct PassState {
  const SpeedProblem* problem = nullptr;
  Doubles x, dx;                       ///< c_k and its step at [k + 1]: one value in front, some behind
  Doubles root;                        ///< 1 / sqrt(c_k)
  Doubles mean, left, right;           ///< speeds over sqrt(c_k): mean of the interval, at its ends
  Doubles dip_scale;                   ///< of the rows P13: 1 / c_k of the start
  std::vector<TwoSided> acceleration;  ///< [group of nodes][joint]
  std::vector<TwoSided> jerk;          ///< [group of intervals][end][joint]
  std::vector<RowState> single;        ///< [group of intervals][c_max, dip at the left, at the right]
  Doubles diag, off1, off2, rhs;       ///< the system P11 at [k + 1]: three diagonals, right side
  Doubles jerk_duals;                  ///< sums of the multipliers of an interval's jerk rows
};

/// What a pass needs of the search: the barrier's mu, and the shares of the last step that are taken.
struct PassStep {
  double mu = 0, alpha = 0, alpha_dual = 0;
};

/// Of a full step: the greatest shares of a slack and of a multiplier that it takes away (above 1: it would
/// become negative), and the sums over all rows of slack times multiplier, slack times the multiplier's step,
/// and so on.
struct StepSums {
  double worst = 0, worst_dual = 0;
  double slack_dual = 0, slack_dual_step = 0, slack_step_dual = 0, steps = 0;
};

/// Brings root, mean, left and right up to date with x.
void update_speeds(PassState& state);

/// Slacks as large as the start allows and at least `least` of the row's room, multipliers mu / slack.
void start_rows(PassState& state, double mu, double least);

/// Makes the rows of an earlier search fit for a new one: slacks at least `least` of the room, multipliers
/// within a factor of 10 of mu / slack.
void centre_rows(PassState& state, double mu, double least);

/// Takes the step on slacks and multipliers (P12), and adds all rows to matrix and right side of P11 for the
/// target mu. Returns the greatest violation g + w of a row (P10), over its room.
double assemble_rows(PassState& state, PassStep step);

/// Finds the steps P12 of slacks and multipliers for state.dx.
StepSums find_row_steps(PassState& state, double mu);

}  // namespace trn::speed
