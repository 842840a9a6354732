#pragma once

#include "core/ports.h"

namespace trn {

/// The bracket of a real machine: RTCP, corrections and inverse kinematics in their one fixed order. Planner
/// and tick hold the same object.
class MachineJointMap final : public JointMap {
 public:
  explicit MachineJointMap(const Kinematics& kinematics) : kinematics_(kinematics) {}

  int joint_count() const TRN_RT override { return kinematics_.joint_count(); }
  KinStatus map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT override;

 private:
  const Kinematics& kinematics_;
};

/// Where the tool really is, judged from joints by the forward kinematics.
struct ToolPose {
  Vec3 p_B, u_B;  ///< tip and axis (towards the spindle) in the table frame
  Vec3 p_W, u_W;  ///< the same in the work frame of the context
};
KinStatus tool_pose(const Kinematics& kinematics, const JointVec& q, const MapContext& context,
                    ToolPose& pose);

}  // namespace trn
