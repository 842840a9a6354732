#include "core/solve_in_place.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

// Eigen's LU decomposition judges.
namespace trn {
namespace {

TEST(SolveInPlace, AnswersAsEigenDoes) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 1; n < 200; ++n) {
    const Eigen::Index size = 1 + n % 12;
    Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return u(random); });
    Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(size, [&] { return u(random); });
    A.row(n % size) *= std::pow(10, 4 * u(random));
    if (n % 3 == 0 && size > 1) A(0, 0) = 0;  // no pivot where one would look first
    const Eigen::VectorXd want = Eigen::MatrixXd(A).partialPivLu().solve(b);
    const double scale = A.inverse().norm() * A.norm() * want.norm();
    solve_in_place(A, b);
    EXPECT_LT((b - want).norm(), 1e-14 * scale) << "system " << n;
  }
}

TEST(SolveInPlace, ASingularMatrixGivesNoNumber) {
  Eigen::Matrix3d A;
  A << 1, 2, 3, 2, 4, 6, 0, 0, 1;
  Eigen::Vector3d b(1, 0, 0);
  solve_in_place(A, b);
  EXPECT_FALSE(b.allFinite());
}

}  // namespace
}  // namespace trn
