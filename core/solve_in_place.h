#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>

#include "core/realtime.h"

namespace trn {

/// Solves A x = b by elimination with a pivot from the rows that are left: b becomes x, and A is used up.
/// Where A is singular, x is not finite. It fits the tick, since it neither allocates nor searches, and any
/// size. For the few unknowns that it is used on, Eigen's own solvers take longer to run, and many times
/// longer to compile.
template <typename Square, typename Vector>
void solve_in_place(Square& A, Vector& b) TRN_RT {
  const Eigen::Index n = A.rows();
  for (Eigen::Index k = 0; k < n; ++k) {
    Eigen::Index pivot = k;
    for (Eigen::Index i = k + 1; i < n; ++i)
      if (std::abs(A(i, k)) > std::abs(A(pivot, k))) pivot = i;
    if (pivot != k) {
      for (Eigen::Index j = k; j < n; ++j) std::swap(A(k, j), A(pivot, j));
      std::swap(b[k], b[pivot]);
    }
    for (Eigen::Index i = k + 1; i < n; ++i) {
      const double share = A(i, k) / A(k, k);
      for (Eigen::Index j = k + 1; j < n; ++j) A(i, j) -= share * A(k, j);
      b[i] -= share * b[k];
    }
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    for (Eigen::Index j = i + 1; j < n; ++j) b[i] -= A(i, j) * b[j];
    b[i] /= A(i, i);
  }
}

}  // namespace trn
