#pragma once

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "kinematics/serial/chain.h"
#include "kinematics/serial/rotary_axes.h"

namespace trn {

/// Which word of a program moves which joint: joint = sense * word.
struct WordOfJoint {
  int word = kX;
  double sense = 1.0;
};

/// Everything a serial machine is; made from config by make_serial.
struct SerialConfig {
  SerialChain chain;
  Joints joints;
  std::array<WordOfJoint, kMaxJoints> words;  ///< by joint
  Pose home_X_BM;                             ///< gauge point in the table, every joint at zero
};

/// Kinematics of a serial chain (docs/sources.md S1 and S2 are instances).
class SerialKinematics final : public Kinematics {
 public:
  explicit SerialKinematics(const SerialConfig& config);

  int joint_count() const TRN_RT override { return joint_count_; }
  unsigned word_mask() const TRN_RT override { return word_mask_; }
  Pose home_X_BM() const TRN_RT override { return config_.home_X_BM; }
  Mat3 orientation(const Vec3& abc) const TRN_RT override;
  KinStatus words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT override;
  KinStatus forward(const JointVec& q, Pose& X_BS) const TRN_RT override;
  KinStatus inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT override;
  KinStatus joints_at_tip(const Vec3& abc, const Vec3& p_BT, const Vec3& tool_offset, const JointVec& seed,
                          Pose& X_BS, JointVec& q) const TRN_RT override;
  KinStatus joints_from_words(const Words& words, JointVec& q) const TRN_RT override;
  KinStatus words_from_joints(const JointVec& q, Words& words) const TRN_RT override;
  bool words_are_joints() const TRN_RT override { return true; }

  /// True: up to two rotary and exactly three independent linear joints, solved without iteration.
  bool closed_form() const TRN_RT { return closed_form_; }

 private:
  JointVec joints_of(const Vec3& abc) const TRN_RT;
  KinStatus linear_joints(const SerialChain::Sweep& at, const Vec3& p_BS, JointVec& q) const TRN_RT;
  KinStatus open_joints_at_tip(const Vec3& p_BT, const Vec3& tool_offset, Pose& X_BS,
                               JointVec& q) const TRN_RT;
  KinStatus inverse_closed(const Pose& X_BS, JointVec& q) const TRN_RT;
  double overtravel(const RotaryAxes::Angles& angles) const TRN_RT;
  void into_limits(RotaryAxes::Angles& angles) const TRN_RT;

  SerialConfig config_;
  RotaryAxes rotary_;
  std::array<int, RotaryAxes::kMax> rotary_joint_{};
  std::array<int, 3> linear_joint_{};
  int joint_count_ = 0;
  unsigned word_mask_ = 0;
  bool rotary_closed_ = true, closed_form_ = false;
};

/// Pose -> joints of any chain by damped Newton steps (Levenberg-Marquardt) from q, at most a fixed number:
/// tip position and tool axis, the turn about the tool left free. q is the answer only if kOk.
KinStatus solve_by_newton(const SerialChain& chain, const Pose& X_BS, JointVec& q) TRN_RT;

}  // namespace trn
