#include "kernel/joint_map.h"

#include <gtest/gtest.h>

#include "core/machine.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

class UprightTool : public testing::TestWithParam<const char*> {};

// With every rotary word at zero a program means the same with RTCP on and off, whoever carries what: the
// same joints, and the tip where the words say.
TEST_P(UprightTool, StandsWhereTheWordsSayWithRtcpOnAndOff) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/" + GetParam() + ".toml"));
  const auto kinematics = make_kinematics(machine);
  const MachineJointMap map(*kinematics);
  MapContext context;
  context.tool_offset = Vec3(0, 0, 35);
  const bool parallel = machine.joints[0].name != "X";
  Words axes = Words::Zero(), tip = Words::Zero();
  axes.head<3>() =
      parallel ? Vec3(12, -9, kinematics->word_mask() & (1u << kB) ? 20 : -320) : Vec3(12, -9, 7);
  tip.head<3>() = kinematics->home_X_BM() * Vec3(axes.head<3>());

  JointVec off, on;
  ASSERT_EQ(map.map(axes, context, off), KinStatus::kOk);
  context.rtcp = true;
  ASSERT_EQ(map.map(tip, context, on), KinStatus::kOk);
  EXPECT_LT((off - on).lpNorm<Eigen::Infinity>(), 1e-9);

  ToolPose pose;
  ASSERT_EQ(tool_pose(*kinematics, off, context, pose), KinStatus::kOk);
  EXPECT_LT((pose.p_B - tip.head<3>()).norm(), 1e-9);
  EXPECT_LT((pose.u_B - Vec3::UnitZ()).norm(), 1e-12);
}

/// Moves nothing.
class NoErrors final : public PoseCorrection {
 public:
  KinStatus correct(const Pose&, const Vec3&, JointVec&) const TRN_RT override { return KinStatus::kOk; }
  KinStatus actual(const JointVec&, Pose&) const TRN_RT override { return KinStatus::kOk; }
};

// What no joints reach has none, with a correction as without.
TEST(JointMap, TheUnreachableStaysSo) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/hexapod.toml"));
  const auto kinematics = make_kinematics(machine);
  const NoErrors correction;
  Words far = Words::Zero();
  far[kX] = 1e5;
  for (const PoseCorrection* pose :
       {static_cast<const PoseCorrection*>(nullptr), static_cast<const PoseCorrection*>(&correction)})
    for (const bool rtcp : {false, true}) {
      MapContext context;
      context.rtcp = rtcp;
      JointVec q;
      EXPECT_NE(MachineJointMap(*kinematics, pose).map(far, context, q), KinStatus::kOk) << rtcp;
    }
}

/// A machine that stands 3 um to the side and 1e-4 rad about X from where it should, and cannot help it.
class Stubborn final : public PoseCorrection {
 public:
  explicit Stubborn(const Kinematics& kinematics) : kinematics_(kinematics) {}
  KinStatus correct(const Pose&, const Vec3&, JointVec&) const TRN_RT override { return KinStatus::kOk; }
  KinStatus actual(const JointVec& q, Pose& X_BS) const TRN_RT override {
    const KinStatus status = kinematics_.forward(q, X_BS);
    X_BS.p.x() += 0.003;
    X_BS.R = X_BS.R * rot_x(1e-4);
    return status;
  }

 private:
  const Kinematics& kinematics_;
};

// The tip of a tool of 100 mm goes 100 * 1e-4 mm along Y with the turn about X.
TEST(JointMap, TellsWhatThePoseCorrectionHasLeft) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/mill.toml"));
  const auto kinematics = make_kinematics(machine);
  const Stubborn correction(*kinematics);
  MapContext context;
  context.tool_offset = Vec3(0, 0, 100);
  Words y = Words::Zero();
  y.head<3>() = Vec3(50, 20, -30);
  MachineJointMap::Parts parts;
  ASSERT_EQ(MachineJointMap(*kinematics, &correction).parts(y, context, parts), KinStatus::kOk);
  EXPECT_NEAR(parts.left_tip_mm, std::hypot(0.003, 0.01), 1e-6);
  EXPECT_NEAR(parts.left_axis_rad, 1e-4, 1e-9);
  EXPECT_TRUE(parts.pose.isZero(0));
}

// With the errors of the machine the tip stands beside where it should, and without them where it should.
TEST(JointMap, WhereTheToolStandsIsToldWithTheErrorsThatAreLeft) {
  const Machine machine = read_machine(load_config(source_dir() + "/configs/mill.toml"));
  const auto kinematics = make_kinematics(machine);
  const Stubborn correction(*kinematics);
  const MachineJointMap map(*kinematics, &correction);
  MapContext context;
  context.tool_offset = Vec3(0, 0, 100);
  Words y = Words::Zero();
  y.head<3>() = Vec3(50, 20, -30);
  JointVec q;
  ASSERT_EQ(MachineJointMap(*kinematics).map(y, context, q), KinStatus::kOk);
  ToolPose ideal, real;
  ASSERT_EQ(tool_pose(*kinematics, q, context, ideal), KinStatus::kOk);
  ASSERT_EQ(tool_pose(map, q, context, real), KinStatus::kOk);
  EXPECT_NEAR((real.p_B - ideal.p_B - Vec3(0.003, 0.01, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((real.u_B - Vec3(0, -1e-4, 1)).norm(), 0, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Configs, UprightTool,
                         testing::Values("cradle", "head", "head_table", "hexapod", "micro_stage", "mill",
                                         "rail_mill"));

}  // namespace
}  // namespace trn
