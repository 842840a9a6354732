#include "kernel/joint_map.h"

#include <cmath>

#include "compensation/rtcp.h"
#include "core/check.h"

namespace trn {

KinStatus MachineJointMap::map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT {
  Pose X_BS;
  KinStatus status = nominal(y, context, q, X_BS);
  if (const auto* p = pose(context.corrections_off); p && status == KinStatus::kOk)
    status = p->correct(X_BS, context.tool_offset, q);
  if (const auto* j = joint(context.corrections_off); j && status == KinStatus::kOk) j->correct(q);
  TRN_CHECK(status != KinStatus::kOk || (q.size() == joint_count() && q.allFinite()));
  return status;
}

/// Joints of the machine without errors; X_BS is filled in only where a correction needs it.
KinStatus MachineJointMap::nominal(const Words& y, const MapContext& context, JointVec& q,
                                   Pose& X_BS) const TRN_RT {
  if (!context.rtcp) {
    Words axes = y;
    axes.head<3>() += R_home_ * context.tool_offset;
    const KinStatus status = kinematics_.joints_from_words(axes, q);
    return status == KinStatus::kOk && pose(context.corrections_off) ? kinematics_.forward(q, X_BS) : status;
  }
  // The rotary words are the seed, so a serial machine's rotary joints are the programmed ones to the bit.
  JointVec seed;
  const KinStatus seeded = kinematics_.joints_from_words(y, seed);
  if (seeded != KinStatus::kOk) seed.setZero(kinematics_.joint_count());
  return kinematics_.joints_at_tip(y.tail<3>(), y.head<3>(), context.tool_offset, seed, X_BS, q);
}

KinStatus MachineJointMap::words_at(const JointVec& q, std::uint8_t corrections_off, Words& words) const {
  MapContext context;
  context.corrections_off = corrections_off;
  return words_at(q, context, words);
}

KinStatus MachineJointMap::words_at(const JointVec& q, const MapContext& context, Words& words) const {
  KinStatus status = kinematics_.words_from_joints(q, words);
  const Words axes = words;
  words.head<3>() -= R_home_ * context.tool_offset;
  if (!pose(context.corrections_off) && !joint(context.corrections_off)) return status;
  // The map differs little from the nominal one: a few simple corrections of the words find its inverse.
  constexpr int kSteps = 30;
  for (int i = 0; i < kSteps && status == KinStatus::kOk; ++i) {
    JointVec q_now;
    Words now;
    status = map(words, context, q_now);
    if (status == KinStatus::kOk) status = kinematics_.words_from_joints(q_now, now);
    words += axes - now;
    if ((axes - now).isZero(0)) break;
  }
  return status;
}

KinStatus MachineJointMap::reached(const JointVec& q, std::uint8_t corrections_off, Pose& X_BS) const {
  JointVec joints = q;
  if (const auto* j = joint(corrections_off)) j->undo(joints);
  const auto* p = pose(corrections_off);
  return p ? p->actual(joints, X_BS) : kinematics_.forward(joints, X_BS);
}

KinStatus MachineJointMap::parts(const Words& y, const MapContext& context, Parts& parts) const {
  parts.pose.setZero(joint_count());
  parts.joint.setZero(joint_count());
  JointVec q, q_pose;
  Pose X_BS;
  KinStatus status = nominal(y, context, q, X_BS);
  if (status != KinStatus::kOk) return status;
  q_pose = q;
  if (const auto* p = pose(context.corrections_off)) {
    status = p->correct(X_BS, context.tool_offset, q_pose);
    Pose X;
    p->actual(q_pose, X);
    parts.left_tip_mm =
        (tip_from_spindle(X, context.tool_offset) - tip_from_spindle(X_BS, context.tool_offset)).norm();
    const Vec3 u = X.R.col(2), wanted = X_BS.R.col(2);
    parts.left_axis_rad = std::atan2(u.cross(wanted).norm(), u.dot(wanted));
  }
  parts.pose = q_pose - q;
  q = q_pose;
  if (const auto* j = joint(context.corrections_off)) j->correct(q);
  parts.joint = q - q_pose;
  return status;
}

namespace {

void fill(const Pose& X_BS, const MapContext& context, ToolPose& pose) {
  pose.p_B = tip_from_spindle(X_BS, context.tool_offset);
  pose.u_B = X_BS.R.col(2);
  pose.p_W = context.X_WB * pose.p_B;
  pose.u_W = context.X_WB.R * pose.u_B;
}

}  // namespace

KinStatus tool_pose(const Kinematics& kinematics, const JointVec& q, const MapContext& context,
                    ToolPose& pose) {
  Pose X_BS;
  const KinStatus status = kinematics.forward(q, X_BS);
  if (status == KinStatus::kOk) fill(X_BS, context, pose);
  return status;
}

KinStatus tool_pose(const MachineJointMap& map, const JointVec& q, const MapContext& context,
                    ToolPose& pose) {
  Pose X_BS;
  const KinStatus status = map.reached(q, context.corrections_off, X_BS);
  if (status == KinStatus::kOk) fill(X_BS, context, pose);
  return status;
}

}  // namespace trn
