#include "core/solve3.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace trn {
namespace {

TEST(Solve3, AgreesWithEigen) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int i = 0; i < 200; ++i) {
    Mat3 A;
    Vec3 b, x;
    for (int k = 0; k < 3; ++k) {
      b[k] = u(random);
      for (int j = 0; j < 3; ++j) A(k, j) = u(random);
    }
    const double volume = solve3(A, b, x);
    EXPECT_NEAR(volume, A.determinant(), 1e-14);
    EXPECT_LT((x - A.partialPivLu().solve(b)).norm() * std::abs(volume), 1e-12);
  }
}

TEST(Solve3, FlatColumnsHaveNoVolume) {
  Mat3 A;
  A << 1, 2, 3, 2, 4, 6, 0, 1, 0;
  Vec3 x;
  EXPECT_EQ(solve3(A, Vec3(1, 1, 1), x), 0);
}

}  // namespace
}  // namespace trn
