#include "kinematics/serial/chain.h"

#include <cmath>

namespace trn {

Mat3 rotation_about(const Vec3& axis, double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), v = 1.0 - c;
  const double x = axis.x(), y = axis.y(), z = axis.z();
  Mat3 R;
  R << c + v * x * x, v * x * y - s * z, v * x * z + s * y,  //
      v * x * y + s * z, c + v * y * y, v * y * z - s * x,   //
      v * x * z - s * y, v * y * z + s * x, c + v * z * z;
  return R;
}

void SerialChain::append_offset(const Vec3& offset_mm) {
  (count_ == 0 ? start_ : steps_[count_ - 1].offset) += offset_mm;
}

void SerialChain::append_joint(int joint, JointKind kind, const Vec3& axis) {
  steps_[count_++] = {joint, kind, axis, Vec3::Zero()};
}

SerialChain::Sweep SerialChain::sweep(const JointVec& q) const TRN_RT {
  Sweep out{Mat3::Identity(), start_, Mat3::Zero()};
  int column = 0;
  bool turned = false;  // the product with the identity is left out
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    if (step.kind == JointKind::kRotary) {
      const Mat3 turn = rotation_about(step.axis, q[step.joint]);
      out.R = turned ? Mat3(out.R * turn) : turn;
      turned = true;
    } else if (column < 3) {
      out.columns.col(column++) = out.R * step.axis;
    }
    out.p += out.R * step.offset;
  }
  return out;
}

Mat3 SerialChain::rotation(const JointVec& q) const TRN_RT {
  Mat3 R = Mat3::Identity();
  for (int i = 0; i < count_; ++i)
    if (steps_[i].kind == JointKind::kRotary)
      R = (R * rotation_about(steps_[i].axis, q[steps_[i].joint])).eval();
  return R;
}

Pose SerialChain::pose(const JointVec& q) const TRN_RT {
  Pose X{Mat3::Identity(), start_};
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    if (step.kind == JointKind::kRotary) {
      X.R = (X.R * rotation_about(step.axis, q[step.joint])).eval();
      X.p += X.R * step.offset;
    } else {
      X.p += X.R * (step.offset + q[step.joint] * step.axis);
    }
  }
  return X;
}

Pose SerialChain::pose_and_jacobian(const JointVec& q, Jacobian& J) const TRN_RT {
  J.setZero(6, q.size());
  std::array<Vec3, kMaxJoints> place, axis_B;
  Pose X{Mat3::Identity(), start_};
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    place[i] = X.p;
    axis_B[i] = X.R * step.axis;
    if (step.kind == JointKind::kRotary) X.R = (X.R * rotation_about(step.axis, q[step.joint])).eval();
    const double travel = step.kind == JointKind::kLinear ? q[step.joint] : 0.0;
    X.p += X.R * (step.offset + travel * step.axis);
  }
  for (int i = 0; i < count_; ++i) {
    const bool rotary = steps_[i].kind == JointKind::kRotary;
    auto column = J.col(steps_[i].joint);
    column.head<3>() = rotary ? Vec3(axis_B[i].cross(X.p - place[i])) : axis_B[i];
    if (rotary) column.tail<3>() = axis_B[i];
  }
  return X;
}

}  // namespace trn
