#pragma once

#include <array>

#include "core/axes.h"
#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// Rotation about the unit vector `axis` (Rodrigues' formula).
Mat3 rotation_about(const Vec3& axis, double angle_rad) TRN_RT;

/// One joint of a serial chain and the fixed offset that follows it. At joint zero all frames are parallel.
struct ChainStep {
  int joint = 0;
  JointKind kind = JointKind::kLinear;
  Vec3 axis = Vec3::UnitZ();   ///< unit; the sign of the branch is in it
  int principal = -1;          ///< 0 to 2: the axis lies along x, y or z; -1: anywhere
  Vec3 offset = Vec3::Zero();  ///< mm, in the frame behind the joint
};

/// The machine as one chain from the table B through the base to the spindle nose S: the work branch is
/// walked backwards, (Trans(o) M(q))^-1 = M(-q) Trans(-o), then the tool branch forwards.
class SerialChain {
 public:
  /// A chain evaluated with its linear joints at zero: p_BS = p + columns * linear joints, R_BS = R.
  struct Sweep {
    Mat3 R;
    Vec3 p;
    Mat3 columns;  ///< direction in B of the first three linear joints, in chain order
  };

  void append_offset(const Vec3& offset_mm);
  void append_joint(int joint, JointKind kind, const Vec3& axis);
  /// How the spindle stands with every joint at zero: a head that is tilted for good. Identity without.
  void set_end(const Mat3& R_end);
  const Mat3& end() const TRN_RT { return R_end_; }

  Sweep sweep(const JointVec& q) const TRN_RT;
  Mat3 rotation(const JointVec& q) const TRN_RT;
  Pose pose(const JointVec& q) const TRN_RT;

  /// Pose of S in B (rotation and position) and its derivative by every joint: rows 0-2 mm per unit of the
  /// joint, rows 3-5 the angular velocity, both in B.
  using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, kMaxJoints>;
  Pose pose_and_jacobian(const JointVec& q, Jacobian& J) const TRN_RT;

  int size() const TRN_RT { return count_; }
  const ChainStep& step(int i) const TRN_RT { return steps_[i]; }

 private:
  void turn_end(Mat3& R) const TRN_RT {
    if (tilted_) R = (R * R_end_).eval();
  }

  Vec3 start_ = Vec3::Zero();
  Mat3 R_end_ = Mat3::Identity();
  bool tilted_ = false;
  std::array<ChainStep, kMaxJoints> steps_;
  int count_ = 0;
};

}  // namespace trn
