#pragma once

#include "interp/plan/speed/speed_problem.h"

namespace trn::speed {

struct InteriorPointOptions {
  int iterations_max = 60;
  double gap = 1e-3;       ///< of the total time, at which the search ends
  double start_use = 0.7;  ///< share of a row that the start may use before the row is widened
  double start_mu = 0.1;   ///< barrier at the start, of the mean time of an interval
};

struct InteriorPointResult {
  bool feasible = false;
  int iterations = 0;
  double time_s = 0;
};

/// Minimises the time sum h / sqrt(c) of a SpeedProblem by a primal-dual interior-point method. Newton steps
/// drop the negative curvature of the jerk rows' right sides, so every step stays on the safe side of them
/// (sequential inner convexification). A start that breaks rows is admitted: those rows are widened just
/// enough and the widening is driven to zero on the way; where that fails the result is not feasible. Each
/// step costs one pentadiagonal factorisation.
class InteriorPoint {
 public:
  /// c: start (> 0) and result, one per interval.
  InteriorPointResult solve(const SpeedProblem& problem, const InteriorPointOptions& options, Doubles& c);

 private:
  void begin(const Doubles& c, double start_use);
  void widen(double start_use);
  void evaluate();
  void assemble(double mu);
  void add_bounds(double mu);
  void add_acceleration(double mu);
  void add_jerk(double mu);
  bool factor_and_solve();
  void row_steps();
  template <typename Visit>
  void for_each_row(Visit visit);
  double primal_step();
  double dual_step(double mu);
  void advance(double mu, double alpha, double alpha_dual);
  bool inside() const;
  double gap();
  double total_time() const;

  const SpeedProblem* p_ = nullptr;
  size_t n_ = 0, inequalities_ = 0;
  double widening_ = 0;
  Doubles x_, dx_;  // c with a zero in front and behind
  Doubles root_;    // 1 / sqrt(c)
  Doubles diag_, off1_, off2_, rhs_, curvature_;
  Doubles acc_wide_, jerk_wide_, bound_wide_;  // widening of each node's / interval's rows at widening_ = 1
  Doubles bound_slack_, bound_dual_, bound_step_;
  // per row: value of the linear form, slack and multiplier of the upper and the lower side, change of the
  // value
  Doubles acc_, acc_up_, acc_low_, acc_dual_up_, acc_dual_low_, acc_step_;
  Doubles jerk_, jerk_up_, jerk_low_, jerk_dual_up_, jerk_dual_low_, jerk_step_;
};

}  // namespace trn::speed
