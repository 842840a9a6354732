#include "kernel/joint_map.h"

#include "compensation/rtcp.h"

namespace trn {

KinStatus MachineJointMap::map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT {
  if (!context.rtcp) {
    Words axes = y;
    axes.head<3>() += context.tool_offset;
    return kinematics_.joints_from_words(axes, q);
  }
  // The rotary words are the seed, so a serial machine's rotary joints are the programmed ones to the bit.
  JointVec seed;
  const KinStatus seeded = kinematics_.joints_from_words(y, seed);
  if (seeded != KinStatus::kOk) seed.setZero(kinematics_.joint_count());
  const Mat3 R_BT = kinematics_.orientation(y.tail<3>());
  return kinematics_.inverse(spindle_from_tip(y.head<3>(), R_BT, context.tool_offset), seed, q);
}

KinStatus tool_pose(const Kinematics& kinematics, const JointVec& q, const MapContext& context,
                    ToolPose& pose) {
  Pose X_BS;
  const KinStatus status = kinematics.forward(q, X_BS);
  if (status != KinStatus::kOk) return status;
  pose.p_B = tip_from_spindle(X_BS, context.tool_offset);
  pose.u_B = X_BS.R.col(2);
  pose.p_W = context.X_WB * pose.p_B;
  pose.u_W = context.X_WB.R * pose.u_B;
  return KinStatus::kOk;
}

}  // namespace trn
