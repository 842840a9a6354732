#include "kinematics/newton.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace trn {
namespace {

template <int N>
void expect_as_by_singular_values(std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int n = 0; n < 500; ++n) {
    Eigen::Matrix<double, N, N> J = Eigen::Matrix<double, N, N>::NullaryExpr([&] { return u(rng); });
    J.row(n % N) *= std::pow(10, 4 * u(rng));  // also ill-conditioned, and with a small pivot first
    if (n % 3 == 0) J(0, 0) = 1e-14;
    const Eigen::VectorXd values = Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues();
    const double product = values.norm() * values.cwiseInverse().norm();
    EXPECT_NEAR(conditioning_of<N>(J) * product / N, 1, 1e-8) << "matrix " << n;
  }
}

TEST(Conditioning, IsThatOfTheSingularValues) {
  expect_as_by_singular_values<4>(1);
  expect_as_by_singular_values<6>(2);
}

TEST(Conditioning, IsOneForAnIsotropicMatrixAndZeroForASingularOne) {
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  EXPECT_DOUBLE_EQ(conditioning_of<6>(3 * Matrix6::Identity()), 1);
  Matrix6 J = Matrix6::Identity();
  J(5, 5) = 0;
  EXPECT_EQ(conditioning_of<6>(J), 0);
  EXPECT_EQ(conditioning_of<6>(Matrix6::Zero()), 0);
}

}  // namespace
}  // namespace trn
