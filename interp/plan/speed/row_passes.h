#pragma once

#include <array>

#include "interp/plan/speed/speed_problem.h"

namespace trn::speed {

/// Slack and multiplier of inequalities g(x) + slack = 0 at a group of places, and the step found for them.
struct RowState {
  Lanes slack, dual, slack_step, dual_step;
};
/// Both sides of |value| <= room.
using TwoSided = std::array<RowState, 2>;

/// What the interior-point method works on; places padded to whole groups, padding inert.
struct PassState {
  const SpeedProblem* problem = nullptr;
  Doubles x, dx;              ///< c and its step at [1 + place], with one value in front and some behind
  Doubles root;               ///< 1 / sqrt(c)
  Doubles mean, left, right;  ///< speeds over sqrt(c): of the interval in the mean, at its ends
  Doubles dip_scale;
  std::vector<TwoSided> acceleration;    ///< [group of nodes][joint]
  std::vector<TwoSided> jerk;            ///< [group of intervals][end][joint]
  std::vector<RowState> single;          ///< [group of intervals][c_max, dip at the left, at the right]
  Doubles diag, off1, off2, rhs, taken;  ///< Newton matrix by [1 + place]; curvature the jerk rows take
};

struct PassStep {
  double mu = 0, alpha = 0, alpha_dual = 0;
};

/// Greatest shares of slacks and multipliers that a full step eats; sums of slack times multiplier and of the
/// products with their steps.
struct StepSums {
  double worst = 0, worst_dual = 0;
  double slack_dual = 0, slack_dual_step = 0, slack_step_dual = 0, steps = 0;
};

/// Brings root, mean, left and right up to date with x.
void update_places(PassState& state);

/// Slacks as large as the start allows and at least `least` of the row's room, multipliers mu / slack.
void start_rows(PassState& state, double mu, double least);

/// Rows of an earlier search for a new one: slacks at least `least` of the room, products near mu.
void centre_rows(PassState& state, double mu, double least);

/// Takes the step on slacks and multipliers, and adds all rows to matrix and right side for the target mu.
/// Returns the greatest violation of a row, over its room.
double assemble_rows(PassState& state, PassStep step);

/// Steps of slacks and multipliers for state.dx.
StepSums find_row_steps(PassState& state, double mu);

}  // namespace trn::speed
