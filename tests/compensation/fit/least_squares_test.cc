#include "compensation/fit/least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <random>

// What the answers must satisfy judges: normal equations, an inverse, a matrix that was made from its
// singular values.
namespace trn {
namespace {

Eigen::MatrixXd any_matrix(Eigen::Index rows, Eigen::Index columns, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

TEST(LeastSquares, FindsTheLeastSum) {
  for (std::uint64_t seed = 1; seed < 30; ++seed) {
    const Eigen::Index columns = 1 + static_cast<Eigen::Index>(seed % 9);
    const Eigen::MatrixXd A = any_matrix(3 * columns + 2, columns, seed);
    const Eigen::VectorXd b = any_matrix(A.rows(), 1, seed + 100), x = LeastSquares(A).solve(b);
    EXPECT_LT((A.transpose() * (b - A * x)).norm(), 1e-12) << seed;  // what is left has nothing along A
  }
}

TEST(LeastSquares, CovarianceIsTheInverseOfTheNormalMatrix) {
  for (std::uint64_t seed = 1; seed < 30; ++seed) {
    const Eigen::MatrixXd A = any_matrix(20, 6, seed), N = A.transpose() * A;
    EXPECT_LT((LeastSquares(A).covariance() * N - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-12) << seed;
  }
}

TEST(LeastSquares, ConditionIsThatOfTheStretches) {
  // An orthogonal matrix with stretches of its own has these for singular values.
  Eigen::MatrixXd Q = Eigen::MatrixXd::Identity(8, 8);
  for (std::uint64_t seed = 7; seed < 12; ++seed) {
    const Eigen::VectorXd across = any_matrix(8, 1, seed).normalized();
    Q -= 2 * across * (across.transpose() * Q).eval();
  }
  Eigen::VectorXd stretches(4);
  stretches << 3, 100, 0.5, 2;
  EXPECT_NEAR(LeastSquares(Q.leftCols(4) * stretches.asDiagonal()).condition(), 200, 1e-9);
}

TEST(LeastSquares, WhatCannotBeToldIsLeftAtNothing) {
  Eigen::MatrixXd A = any_matrix(10, 3, 9);
  A.col(2) = A.col(0) - 2 * A.col(1);
  const LeastSquares equations(A);
  EXPECT_EQ(equations.rank(), 2);
  EXPECT_GT(equations.condition(), 1e14);
  const Eigen::VectorXd b = A * Eigen::Vector3d(1, 2, 0), x = equations.solve(b);
  EXPECT_LT((A * x - b).norm(), 1e-12);
  EXPECT_LT(std::abs(x.dot(Eigen::Vector3d(1, -2, -1))), 1e-12);  // nothing along what A does not see
}

}  // namespace
}  // namespace trn
