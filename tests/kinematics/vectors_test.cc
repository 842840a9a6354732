#include <gtest/gtest.h>

#include "core/units.h"
#include "tests/kinematics/machines.h"

// Every row of the worked numbers in tests/data/vectors against the shipped configs, to 1e-9 mm and 1e-12 rad.
namespace trn {
namespace {

constexpr double kMm = 1e-9, kRad = 1e-12;

/// Forward and inverse of one row of a serial machine; `lengths` is the tool length the row speaks of.
void check_serial_row(const Kinematics& kinematics, const JointVec& q, const Vec3& tip, const Vec3& axis,
                      double tool_length_mm) {
  Pose X_BS;
  ASSERT_EQ(kinematics.forward(q, X_BS), KinStatus::kOk);
  EXPECT_LT((X_BS * Vec3(0, 0, -tool_length_mm) - tip).norm(), kMm);
  EXPECT_LT((X_BS.R.col(2) - axis).norm(), kRad);
  // Back, from the tip and axis alone; the seed only tells the branch.
  Vec3 abc;
  JointVec seed = q;
  for (Eigen::Index i = 3; i < q.size(); ++i) seed[i] += i == 3 ? 0.05 : -0.07;
  Words seed_words;
  ASSERT_EQ(kinematics.words_from_joints(seed, seed_words), KinStatus::kOk);
  ASSERT_EQ(kinematics.words_for_axis(axis, seed_words.tail<3>(), abc), KinStatus::kOk);
  const Pose wanted{kinematics.orientation(abc), tip + tool_length_mm * axis};
  JointVec back;
  ASSERT_EQ(kinematics.inverse(wanted, seed, back), KinStatus::kOk);
  EXPECT_LT((back - q).head(3).norm(), kMm);
  EXPECT_LT((back - q).tail(2).norm(), kRad);
}

TEST(Vectors, CradleNominal) {
  const LoadedMachine cradle = load_machine("cradle");
  for (const auto& row : load_vectors("cradle_pige").at("rows"))
    check_serial_row(*cradle.kinematics, joints_of(row.at("joints")), vec3_of(row.at("tip_nominal")),
                     vec3_of(row.at("axis_nominal")), row.at("tool_length"));
}

}  // namespace
}  // namespace trn
