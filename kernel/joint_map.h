#pragma once

#include <atomic>

#include "core/ports.h"

namespace trn {

/// The bracket of a real machine: RTCP, corrections and inverse kinematics in their one fixed order. Planner
/// and tick hold the same object.
class MachineJointMap final : public JointMap {
 public:
  /// All must outlive the map; a correction may be null.
  explicit MachineJointMap(const Kinematics& kinematics, const PoseCorrection* pose = nullptr,
                           const JointCorrection* joint = nullptr)
      : kinematics_(kinematics), pose_(pose), joint_(joint) {}

  int joint_count() const TRN_RT override { return kinematics_.joint_count(); }
  KinStatus map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT override;

  /// The machine's own axes (RTCP off, no tool) at joints q: the inverse of `map`.
  KinStatus words_at(const JointVec& q, Words& words) const;
  /// Where the machine really stands at joints q, as far as the corrections know its errors.
  KinStatus reached(const JointVec& q, Pose& X_BS) const;
  /// What the corrections inside the plan add at this place, mm or rad; zero where there are none.
  struct Parts {
    JointVec pose, joint;
    double left_tip_mm = 0, left_axis_rad = 0;  ///< what `pose` could not put right
  };
  KinStatus parts(const Words& y, const MapContext& context, Parts& parts) const;
  bool corrects() const TRN_RT { return pose() || joint(); }
  bool has_pose() const { return pose_ != nullptr; }
  bool has_joint() const { return joint_ != nullptr; }
  /// Switches a correction that the machine has; with the machine at rest and nothing planned.
  void enable_pose(bool on) { pose_on_ = on; }
  void enable_joint(bool on) { joint_on_ = on; }
  const PoseCorrection* pose() const TRN_RT {
    return pose_on_.load(std::memory_order_relaxed) ? pose_ : nullptr;
  }
  const JointCorrection* joint() const TRN_RT {
    return joint_on_.load(std::memory_order_relaxed) ? joint_ : nullptr;
  }

 private:
  KinStatus nominal(const Words& y, const MapContext& context, JointVec& q, Pose& X_BS) const TRN_RT;

  const Kinematics& kinematics_;
  const PoseCorrection* pose_;
  const JointCorrection* joint_;
  std::atomic<bool> pose_on_{true}, joint_on_{true};
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
