#include "core/frames.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

// Eigen's angle-axis rotations and homogeneous matrices judge.
namespace trn {
namespace {

Eigen::Matrix4d matrix_of(const Pose& X) {
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  out.topLeftCorner<3, 3>() = X.R;
  out.topRightCorner<3, 1>() = X.p;
  return out;
}

TEST(Frames, TurnsAreRightHanded) {
  for (const double angle : {-2.0, -0.3, 0.0, 1e-9, 0.7, 3.0}) {
    EXPECT_LT((rot_x(angle) - Eigen::AngleAxisd(angle, Vec3::UnitX()).matrix()).norm(), 1e-15);
    EXPECT_LT((rot_y(angle) - Eigen::AngleAxisd(angle, Vec3::UnitY()).matrix()).norm(), 1e-15);
    EXPECT_LT((rot_z(angle) - Eigen::AngleAxisd(angle, Vec3::UnitZ()).matrix()).norm(), 1e-15);
  }
}

TEST(Frames, PosesMultiplyAndInvertAsHomogeneousMatrices) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int i = 0; i < 100; ++i) {
    const Pose a{rot_z(u(random)) * rot_x(u(random)), Vec3(u(random), u(random), u(random))};
    const Pose b{rot_y(u(random)) * rot_z(u(random)), Vec3(u(random), u(random), u(random))};
    const Vec3 p(u(random), u(random), u(random));
    EXPECT_LT((matrix_of(a * b) - matrix_of(a) * matrix_of(b)).norm(), 1e-13);
    EXPECT_LT((matrix_of(inverse(a)) - matrix_of(a).inverse()).norm(), 1e-13);
    EXPECT_LT((a * p - (matrix_of(a) * p.homogeneous()).head<3>()).norm(), 1e-13);
    EXPECT_LT((translation(b.p) * p - (b.p + p)).norm(), 1e-15);
  }
}

TEST(Frames, TheTurnBetweenTwoDirectionsIsTheShortest) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 from = Vec3(normal(random), normal(random), normal(random)).normalized();
    Vec3 to = Vec3(normal(random), normal(random), normal(random)).normalized();
    if (i % 3 == 1) to = (from + std::pow(10, -i % 18) * to).normalized();
    if (i % 3 == 2) to = (-from + std::pow(10, -i % 18) * to).normalized();
    const Mat3 R = turn_between(from, to);
    EXPECT_LT((R * from - to).norm(), 1e-15) << i;
    EXPECT_LT((R * R.transpose() - Mat3::Identity()).norm(), 2e-15) << i;
    EXPECT_GT(R.determinant(), 0) << i;
    // The shortest: by the angle between the two and no more, which the trace tells.
    EXPECT_NEAR(R.trace(), 1 + 2 * from.dot(to), 1e-14) << i;
  }
  for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY()), Vec3(Vec3::UnitZ())})
    EXPECT_LT((turn_between(axis, -axis) * axis + axis).norm(), 1e-15);
}

}  // namespace
}  // namespace trn
