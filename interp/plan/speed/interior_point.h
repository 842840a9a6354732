#pragma once

#include "interp/plan/lanes.h"
#include "interp/plan/speed/row_passes.h"
#include "interp/plan/speed/speed_problem.h"

namespace trn::speed {

struct InteriorPointOptions {
  int iterations_max = 60;
  double gap = 1e-3;      ///< of the total time, at which the search ends
  double start_mu = 0.1;  ///< barrier at the start, of the mean time of an interval
};

struct InteriorPointResult {
  bool feasible = false;
  int iterations = 0;
  double time_s = 0;
};

/// Minimises the time P7 (docs/planner.md), sum h / sqrt(c), of a SpeedProblem by a primal-dual
/// interior-point method with slacks, so that the start need not keep the rows. Newton steps drop the
/// negative curvature of the jerk rows' right sides (sequential inner convexification) and hold the speeds
/// that multiply their terms; both are brought up to date after every step. Each step costs two passes over
/// the rows and one pentadiagonal factorisation.
class InteriorPoint {
 public:
  /// c: start (> 0) and result, one per interval.
  InteriorPointResult solve(const SpeedProblem& problem, const InteriorPointOptions& options, Doubles& c);
  /// Again from where the last search ended, for the same problem with rows a little changed.
  InteriorPointResult resume(const SpeedProblem& problem, const InteriorPointOptions& options, Doubles& c);

 private:
  void set_start(const SpeedProblem& problem, const Doubles& c);
  InteriorPointResult search(double mu, const InteriorPointOptions& options, Doubles& c);
  void add_time();
  bool factor_and_solve();
  double primal_step(double worst) const;
  double total_time() const;

  PassState state_;
  size_t n_ = 0;
};

}  // namespace trn::speed
