#pragma once

#include <Eigen/Dense>

#include "core/ports.h"

namespace trn {

/// How a bounded Newton iteration went.
struct NewtonReport {
  KinStatus status = KinStatus::kUnreachable;
  int iterations = 0;  ///< steps until a root was reached; polishing is not counted
};

/// Newton with step halving for N equations in N unknowns, at most `kIterationsMax` steps of at most
/// `kHalvingsMax` halvings. The model offers
///   evaluate(state, e, J): residual e (mm) and its derivative J by a step;
///   moved(state, step): the state after a step.
/// `state` is the start and the answer. kUnreachable: no root was found from this start.
template <int N, typename Model, typename State>
NewtonReport solve_newton(const Model& model, State& state) TRN_RT {
  constexpr int kIterationsMax = 40, kHalvingsMax = 10;
  constexpr double kRoundingMm = 2e-13, kReachedMm = 1e-9;
  Eigen::Matrix<double, N, 1> e;
  Eigen::Matrix<double, N, N> J;
  NewtonReport report;
  model.evaluate(state, e, J);
  double error = e.norm();
  bool improving = true;
  for (int i = 0; improving && error > kRoundingMm && i < kIterationsMax; ++i) {
    if (error > kReachedMm) ++report.iterations;
    Eigen::Matrix<double, N, 1> step = J.partialPivLu().solve(-e);
    improving = false;
    // Once reached, plain steps go on while they help: an ill-conditioned pose needs the last digits.
    const int tries = error < kReachedMm ? 1 : kHalvingsMax;
    for (int halving = 0; !improving && halving < tries; ++halving, step *= 0.5) {
      const State trial = model.moved(state, step);
      model.evaluate(trial, e, J);
      if (!(e.norm() < error)) continue;  // a NaN is no improvement either
      state = trial;
      error = e.norm();
      improving = true;
    }
  }
  report.status = error < kReachedMm ? KinStatus::kOk : KinStatus::kUnreachable;
  return report;
}

/// Inverse condition number of a square matrix in the Frobenius norm, scaled to 1 for an isotropic one; 0 if
/// singular.
template <int N>
double conditioning_of(const Eigen::Matrix<double, N, N>& J) TRN_RT {
  const double product = J.norm() * J.inverse().norm();
  return std::isfinite(product) ? N / product : 0.0;
}

}  // namespace trn
