#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "core/ports.h"
#include "core/realtime.h"
#include "core/solve_in_place.h"

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
    Eigen::Matrix<double, N, 1> step = -e;
    solve_in_place(J, step);
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

/// Frobenius norm of a square matrix' inverse; not finite if it is singular. Gauss-Jordan elimination in
/// place with a pivot from the rows that are left. Their exchange only permutes the inverse's columns, which
/// the norm does not see. For the tick: a fifth of the instructions of Eigen's inverse, which is made for
/// large matrices.
template <int N>
double inverse_norm(const Eigen::Matrix<double, N, N>& matrix) TRN_RT {
  Eigen::Matrix<double, N, N, Eigen::RowMajor> m = matrix;
  for (int k = 0; k < N; ++k) {
    int pivot = k;
    for (int i = k + 1; i < N; ++i)
      if (std::abs(m(i, k)) > std::abs(m(pivot, k))) pivot = i;
    if (pivot != k) m.row(k).swap(m.row(pivot));
    const double by_pivot = 1 / m(k, k);
    m(k, k) = 1;
    m.row(k) *= by_pivot;
    for (int i = 0; i < N; ++i) {
      if (i == k) continue;
      const double share = m(i, k);
      m(i, k) = 0;
      m.row(i) -= share * m.row(k);
    }
  }
  return m.norm();
}

/// Inverse condition number of a square matrix in the Frobenius norm, scaled to 1 for an isotropic one; 0 if
/// singular.
template <int N>
double conditioning_of(const Eigen::Matrix<double, N, N>& J) TRN_RT {
  const double product = J.norm() * inverse_norm<N>(J);
  return std::isfinite(product) ? N / product : 0.0;
}

}  // namespace trn
