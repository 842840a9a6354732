#pragma once

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"

namespace trn {

/// The joint map of a real machine, in one fixed order: RTCP and inverse kinematics give the joints of the
/// machine without errors, the pose correction moves these joints, the joint correction each of them alone.
/// Planner and tick hold the same object.
class MachineJointMap final : public JointMap {
 public:
  /// All must outlive the map; a correction may be null.
  explicit MachineJointMap(const Kinematics& kinematics, const PoseCorrection* pose = nullptr,
                           const JointCorrection* joint = nullptr)
      : kinematics_(kinematics), pose_(pose), joint_(joint), R_home_(kinematics.orientation(Vec3::Zero())) {}

  int joint_count() const TRN_RT override { return kinematics_.joint_count(); }
  KinStatus map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT override;

  /// The machine's own axes (RTCP off, no tool) at joints q: the inverse of `map`.
  KinStatus words_at(const JointVec& q, std::uint8_t corrections_off, Words& words) const;
  /// The words of a context with RTCP off whose joints are q: its tool enters the corrections.
  KinStatus words_at(const JointVec& q, const MapContext& context, Words& words) const;
  /// Where the machine really stands at joints q, as far as the corrections at work know its errors.
  KinStatus reached(const JointVec& q, std::uint8_t corrections_off, Pose& X_BS) const;
  /// What the corrections inside the plan add at this place, mm or rad; zero where there are none.
  struct Parts {
    JointVec pose, joint;
    double left_tip_mm = 0, left_axis_rad = 0;  ///< what `pose` could not put right
  };
  KinStatus parts(const Words& y, const MapContext& context, Parts& parts) const;
  bool has_pose() const { return pose_ != nullptr; }
  bool has_joint() const { return joint_ != nullptr; }
  /// The corrections at work; null: none.
  const PoseCorrection* pose(std::uint8_t off) const TRN_RT { return off & kGeometricBit ? nullptr : pose_; }
  const JointCorrection* joint(std::uint8_t off) const TRN_RT {
    return off & kJointTableBit ? nullptr : joint_;
  }

 private:
  KinStatus nominal(const Words& y, const MapContext& context, JointVec& q, Pose& X_BS) const TRN_RT;

  const Kinematics& kinematics_;
  const PoseCorrection* pose_;
  const JointCorrection* joint_;
  Mat3 R_home_;  ///< of Kinematics::tool_in_words
};

/// Where the tool really is, judged from joints by the forward kinematics.
struct ToolPose {
  Vec3 p_B, u_B;  ///< tip and axis (towards the spindle) in the table frame
  Vec3 p_W, u_W;  ///< the same in the work frame of the context
};
KinStatus tool_pose(const Kinematics& kinematics, const JointVec& q, const MapContext& context,
                    ToolPose& pose);
/// The same through `MachineJointMap::reached`.
KinStatus tool_pose(const MachineJointMap& map, const JointVec& q, const MapContext& context, ToolPose& pose);

}  // namespace trn
