#include "interp/plan/speed/interior_point.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn::speed {

namespace {

constexpr double kToBoundary = 0.99;  // share of the way to the nearest boundary that a step may go
constexpr double kMuCut = 0.15;       // factor on mu after a step that went nearly all the way
constexpr double kMuLeast = 0.03;     // of the mu at which the gap would be reached
constexpr double kStartSlack = 0.5;   // least slack at the start, of the row's room
constexpr double kResumeSlack = 1e-3;
constexpr double kResidual = 5e-4;  // greatest violation of a row in a result, of its room

}  // namespace

InteriorPointResult InteriorPoint::solve(const SpeedProblem& problem, const InteriorPointOptions& options,
                                         Doubles& c) {
  set_start(problem, c);
  state_.dip_scale.assign(state_.root.size(), 1 / state_.x.back());  // stays, as the rows' slacks go by it
  for (size_t k = 0; k < n_; ++k) state_.dip_scale[k] = 1 / c[k];
  const double mu = options.start_mu * total_time() / static_cast<double>(n_);
  start_rows(state_, mu, kStartSlack);
  return search(mu, options, c);
}

// The rows have changed a little since the last search, so its slacks and multipliers are nearly right; only
// those too near 0 are moved away (kResumeSlack).
InteriorPointResult InteriorPoint::resume(const SpeedProblem& problem, const InteriorPointOptions& options,
                                          Doubles& c) {
  set_start(problem, c);
  const double mu = options.start_mu * total_time() / static_cast<double>(n_);
  centre_rows(state_, mu, kResumeSlack);
  return search(mu, options, c);
}

void InteriorPoint::set_start(const SpeedProblem& problem, const Doubles& c) {
  state_.problem = &problem;
  n_ = problem.intervals;
  TRN_CHECK(n_ > 0 && c.size() <= lane_groups(n_ + 1) * kLanes + kLanes);
  const size_t padded = (lane_groups(n_ + 1) + 1) * kLanes;
  const double beyond = problem.c_max[n_] / 2;  // padding keeps every row
  state_.x.assign(padded + 2, beyond);
  state_.dx.assign(padded + 2, 0);
  std::copy(c.begin(), c.end(), state_.x.begin() + 1);
  if (problem.first_fixed) state_.x[1] = problem.first_c;
  for (Doubles* v : {&state_.mean, &state_.left, &state_.right, &state_.jerk_duals}) v->assign(padded, 1);
  state_.root.assign(padded, 1 / std::sqrt(beyond));
  update_speeds(state_);
}

// One Newton step a turn: assemble P11, solve it, find the steps P12, go as far along them as slacks and
// multipliers stay positive (fraction to the boundary). Slacks make the start free; violation g + w falls by
// 1 - alpha a step. mu follows the mean of z w: down by kMuCut after long steps, and hardly after short ones,
// which show that the iterate is far from the central path.
InteriorPointResult InteriorPoint::search(double mu, const InteriorPointOptions& options, Doubles& c) {
  InteriorPointResult result;
  const double rows = static_cast<double>(
      kLanes * (2 * state_.acceleration.size() + 2 * state_.jerk.size() + state_.single.size()));
  PassStep step{mu, 0, 0};
  double gap = 1e30;
  for (;; ++result.iterations) {
    const double violation = assemble_rows(state_, step);
    result.feasible = violation < kResidual;
    result.time_s = total_time();
    if (result.feasible && gap < options.gap * result.time_s) break;
    if (result.iterations == options.iterations_max) break;
    add_time();
    if (!factor_and_solve()) break;
    const StepSums sums = find_row_steps(state_, step.mu);
    step.alpha = primal_step(sums.worst);
    step.alpha_dual = kToBoundary / std::max(kToBoundary, sums.worst_dual);
    for (size_t k = 1; k <= n_; ++k) state_.x[k] += step.alpha * state_.dx[k];
    gap = sums.slack_dual + step.alpha * sums.slack_step_dual + step.alpha_dual * sums.slack_dual_step +
          step.alpha * step.alpha_dual * sums.steps;
    const double quality = std::min(step.alpha, step.alpha_dual);
    step.mu = gap / rows * (quality > 0.7 ? kMuCut : quality > 0.3 ? 0.5 : 1.0);
    step.mu = std::max(step.mu, kMuLeast * options.gap * result.time_s / rows);
    update_speeds(state_);
  }
  c.assign(state_.x.begin() + 1, state_.x.begin() + 1 + static_cast<std::ptrdiff_t>(n_));
  return result;
}

// The right side -f' and the curvature H of P11 for the time P7. The room 1 / sqrt(c) of the rows P9 is
// convex. Its second derivative 0.75 c^(-5/2), times the sum of the rows' multipliers, has the form of H and
// is subtracted. A floor keeps the matrix positive definite: this is where the negative curvature is dropped.
void InteriorPoint::add_time() {
  for (size_t k = 0; k < n_; ++k) {
    const double h = state_.problem->h[k], cube = state_.root[k] / state_.x[k + 1];
    state_.rhs[k + 1] += 0.5 * h * cube;
    state_.diag[k + 1] += 0.75 * std::max(h - state_.jerk_duals[k], 1e-3 * h) * cube / state_.x[k + 1];
  }
}

// Solves P11: L D L^T of the pentadiagonal matrix, in place, with the forward substitution in the same loop.
// Entries 1..n are the unknowns; a first coefficient that is given keeps dx = 0. False: a pivot is not
// positive.
bool InteriorPoint::factor_and_solve() {
  double *const diag = state_.diag.data(), *const off1 = state_.off1.data(), *const off2 = state_.off2.data();
  double* const dx = state_.dx.data();
  const size_t first = state_.problem->first_fixed ? 2 : 1;
  off1[n_] = off2[n_] = off2[n_ - 1] = 0;
  for (size_t i = first; i <= n_; ++i) dx[i] = state_.rhs[i];
  for (size_t i = first; i <= n_; ++i) {
    if (!(diag[i] > 0) || !std::isfinite(diag[i])) return false;
    const double e1 = off1[i], e2 = off2[i], inverse = 1 / diag[i], f1 = e1 * inverse, f2 = e2 * inverse;
    diag[i + 1] -= f1 * e1;
    off1[i + 1] -= f1 * e2;
    diag[i + 2] -= f2 * e2;
    dx[i + 1] -= f1 * dx[i];
    dx[i + 2] -= f2 * dx[i];
    dx[i] *= inverse;
    off1[i] = f1;
    off2[i] = f2;
  }
  dx[n_ + 1] = dx[n_ + 2] = 0;
  for (size_t i = n_; i >= first; --i) dx[i] -= off1[i] * dx[i + 1] + off2[i] * dx[i + 2];
  return true;
}

// The share of the step dx: kToBoundary of the way to the first slack at 0, and no coefficient falls by more
// than 70 % or grows fivefold, as the speeds in the rows are those of the step before.
double InteriorPoint::primal_step(double worst) const {
  worst = std::max(kToBoundary, worst);
  TRN_CHECK(worst > 0);
  for (size_t k = 1; k <= n_; ++k) {
    const double growth = state_.dx[k] / state_.x[k];
    worst = std::max({worst, -growth / 0.7, growth / 4.0});
  }
  return kToBoundary / worst;
}

// The time P7.
double InteriorPoint::total_time() const {
  double sum = 0;
  for (size_t k = 0; k < n_; ++k) sum += state_.problem->h[k] * state_.root[k];
  return sum;
}

}  // namespace trn::speed
