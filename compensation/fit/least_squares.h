#pragma once

#include <Eigen/Core>

namespace trn {

/// What a linear fit A x = b asks of its matrix A (equations x unknowns, at least as many equations):
/// solution, covariance and condition, all of one singular value decomposition. For every fit of this folder,
/// so that the decomposition is compiled once.
class LeastSquares {
 public:
  explicit LeastSquares(const Eigen::MatrixXd& A);

  /// The x of the least sum of squares of A x - b, and the shortest of them where A cannot tell.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  /// The inverse of A^T A: the covariance of x, for independent noise of variance 1 on every equation.
  Eigen::MatrixXd covariance() const;
  /// Largest singular value over the smallest; infinite where an unknown cannot be told.
  double condition() const;
  /// How many unknowns, or sums of them, the equations can tell.
  Eigen::Index rank() const;

 private:
  Eigen::MatrixXd U_, V_;
  Eigen::VectorXd values_;  // falling
};

}  // namespace trn
