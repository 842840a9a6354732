#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "kinematics/machines/hexapod.h"
#include "kinematics/machines/rail_mill.h"
#include "kinematics/platform_kinematics.h"
#include "tests/kinematics/machines.h"

// Every row of the worked numbers in tests/data/vectors against the shipped configs, to 1e-9 mm and 1e-12
// rad.
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
  for (const auto& row : vector_rows("cradle_pige"))
    check_serial_row(*cradle.kinematics, joints_of(row.at("joints")), vec3_of(row.at("tip_nominal")),
                     vec3_of(row.at("axis_nominal")), row.at("tool_length"));
}

TEST(Vectors, Head) {
  const LoadedMachine head = load_machine("head");
  for (const auto& row : vector_rows("head"))
    check_serial_row(*head.kinematics, joints_of(row.at("joints")), vec3_of(row.at("tip")),
                     vec3_of(row.at("axis")), row.at("pivot_to_tip"));
}

TEST(Vectors, Hexapod) {
  const LoadedMachine hexapod = load_machine("hexapod");
  const Kinematics& kinematics = *hexapod.kinematics;
  const auto& platform = dynamic_cast<const PlatformKinematics&>(kinematics);
  for (const auto& row : vector_rows("hexapod")) {
    const Vec3 point = vec3_of(row.at("point_on_platform")), abc(row.at("A"), row.at("B"), 0);
    const Pose X_BS{kinematics.orientation(abc), point};  // no tool: the gauge point is the tip
    const JointVec legs = joints_of(row.at("legs"));
    JointVec q;
    ASSERT_EQ(kinematics.inverse(X_BS, JointVec::Zero(6), q), KinStatus::kOk);
    EXPECT_LT((q - legs).lpNorm<Eigen::Infinity>(), kMm);
    const Pose X_RP = platform.platform_from_spindle(X_BS);
    EXPECT_LT((X_RP.p - vec3_of(row.at("table_position"))).norm(), kMm);
    for (int i = 0; i < 3; ++i)
      EXPECT_LT((X_RP.R.row(i).transpose() - vec3_of(row.at("table_rotation").at(i))).norm(), kRad);
    Pose back;
    ASSERT_EQ(kinematics.forward(legs, back), KinStatus::kOk);
    EXPECT_LT((back.p - point).norm(), kMm);
    EXPECT_LT((back.R - X_BS.R).norm(), kRad);
  }
}

TEST(Vectors, RailMill) {
  const LoadedMachine rail_mill = load_machine("rail_mill");
  const Kinematics& kinematics = *rail_mill.kinematics;
  for (const auto& row : vector_rows("rail")) {
    const Pose X_BS{kinematics.orientation(Vec3(row.at("alpha"), 0, 0)), vec3_of(row.at("position"))};
    const JointVec rails = joints_of(row.at("rails"));
    JointVec q;
    ASSERT_EQ(kinematics.inverse(X_BS, JointVec::Zero(4), q), KinStatus::kOk);
    EXPECT_LT((q - rails).lpNorm<Eigen::Infinity>(), kMm);
    Pose back;
    ASSERT_EQ(kinematics.forward(rails, back), KinStatus::kOk);
    EXPECT_LT((back.p - X_BS.p).norm(), kMm);
    EXPECT_LT((back.R - X_BS.R).norm(), kRad);
  }
}

}  // namespace
}  // namespace trn
