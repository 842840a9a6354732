#pragma once

#include <array>

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
  /// Two-sided rows, one family: |value| <= room. [row * places + place]; side 0 upper, 1 lower.
  struct Rows {
    size_t places = 0, rows = 0;
    Doubles value, step;
    std::array<Doubles, 2> slack, inverse, dual, dual_step;
    void resize(size_t row_count, size_t place_count);
  };
  void begin(const Doubles& c, const InteriorPointOptions& options);
  void widen(double start_use);
  void start_duals(double mu);
  bool evaluate();
  bool evaluate_rows(Rows& rows, const Doubles& room);
  void assemble(double mu);
  void add_bounds(double mu);
  void add_acceleration(double mu);
  void add_jerk(double mu);
  bool factor_and_solve();
  void find_steps(double mu);
  void row_steps(Rows& rows, const Doubles& room_change, double mu, Doubles& worst, Doubles& worst_dual);
  double primal_step() const;
  double dual_step() const;
  void advance(double alpha, double alpha_dual);
  double gap();
  double total_time() const;

  const SpeedProblem* p_ = nullptr;
  size_t n_ = 0, inequalities_ = 0;
  double widening_ = 0;
  Doubles x_, dx_;  // c with a zero in front and behind
  Doubles root_;    // 1 / sqrt(c)
  Doubles diag_, off1_, off2_, rhs_, curvature_;
  Doubles acc_wide_, jerk_wide_, bound_wide_;  // widening of each node's / interval's rows at widening_ = 1
  Doubles acc_room_, jerk_room_;
  Doubles bound_slack_, bound_dual_, bound_dual_step_;
  Rows acc_, jerk_;
  Doubles worst_acc_, worst_acc_dual_, worst_jerk_, worst_jerk_dual_, sums_;  // by place
};

}  // namespace trn::speed
