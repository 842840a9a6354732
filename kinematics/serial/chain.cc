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

namespace {

int principal_axis(const Vec3& axis) {
  for (int i = 0; i < 3; ++i)
    if (std::abs(axis[i]) == 1) return i;
  return -1;
}

/// R <- R * rotation about the step's axis; along x, y or z only two columns change.
void turn(Mat3& R, const ChainStep& step, double angle_rad) TRN_RT {
  // Nearly every real axis lies along x, y or z of the machine. Then one column stays as it is, and four
  // products a row do instead of nine; a 45 degree head takes the general way.
  if (step.principal < 0) {
    R = (R * rotation_about(step.axis, angle_rad)).eval();
    return;
  }
  const double c = std::cos(angle_rad), s = step.axis[step.principal] * std::sin(angle_rad);
  const int i = (step.principal + 1) % 3, j = (step.principal + 2) % 3;
  const Vec3 before = R.col(i);
  R.col(i) = c * before + s * R.col(j);
  R.col(j) = c * R.col(j) - s * before;
}

/// The step's axis, seen from where R leads.
Vec3 direction(const Mat3& R, const ChainStep& step) TRN_RT {
  return step.principal < 0 ? Vec3(R * step.axis) : Vec3(step.axis[step.principal] * R.col(step.principal));
}

}  // namespace

void SerialChain::append_offset(const Vec3& offset_mm) {
  (count_ == 0 ? start_ : steps_[count_ - 1].offset) += offset_mm;
}

void SerialChain::append_joint(int joint, JointKind kind, const Vec3& axis) {
  steps_[count_++] = {joint, kind, axis, principal_axis(axis), Vec3::Zero()};
}

void SerialChain::set_end(const Mat3& R_end) {
  R_end_ = R_end;
  tilted_ = !R_end.isIdentity(0);
}

SerialChain::Sweep SerialChain::sweep(const JointVec& q) const TRN_RT {
  Sweep out{Mat3::Identity(), start_, Mat3::Zero()};
  int column = 0;
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    if (step.kind == JointKind::kRotary) {
      turn(out.R, step, q[step.joint]);
      // A linear joint does not turn anything, so the pose is linear in all of them. With their places at
      // zero and their directions noted, the caller finds them by one system of three equations.
    } else if (column < 3) {
      out.columns.col(column++) = direction(out.R, step);
    }
    out.p += out.R * step.offset;
  }
  turn_end(out.R);
  return out;
}

Mat3 SerialChain::rotation(const JointVec& q) const TRN_RT {
  Mat3 R = Mat3::Identity();
  for (int i = 0; i < count_; ++i)
    if (steps_[i].kind == JointKind::kRotary) turn(R, steps_[i], q[steps_[i].joint]);
  turn_end(R);
  return R;
}

Pose SerialChain::pose(const JointVec& q) const TRN_RT {
  Pose X{Mat3::Identity(), start_};
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    if (step.kind == JointKind::kRotary) {
      turn(X.R, step, q[step.joint]);
      X.p += X.R * step.offset;
    } else {
      X.p += X.R * step.offset + q[step.joint] * direction(X.R, step);
    }
  }
  turn_end(X.R);
  return X;
}

Pose SerialChain::pose_and_jacobian(const JointVec& q, Jacobian& J) const TRN_RT {
  J.setZero(6, q.size());
  std::array<Vec3, kMaxJoints> place, axis_B;
  Pose X{Mat3::Identity(), start_};
  for (int i = 0; i < count_; ++i) {
    const ChainStep& step = steps_[i];
    // A joint acts at the place and in the direction that its frame has behind the joints before it. Both are
    // noted on the way, since the tip, which the lever arm of a turn needs, is known only at the end.
    place[i] = X.p;
    axis_B[i] = direction(X.R, step);
    if (step.kind == JointKind::kRotary) turn(X.R, step, q[step.joint]);
    const double travel = step.kind == JointKind::kLinear ? q[step.joint] : 0.0;
    X.p += X.R * step.offset + travel * axis_B[i];
  }
  for (int i = 0; i < count_; ++i) {
    const bool rotary = steps_[i].kind == JointKind::kRotary;
    auto column = J.col(steps_[i].joint);
    // The columns of a geometric Jacobian: a turn about w through `place` moves the tip by w x (tip - place),
    // a slide moves it along its axis and turns nothing.
    column.head<3>() = rotary ? Vec3(axis_B[i].cross(X.p - place[i])) : axis_B[i];
    if (rotary) column.tail<3>() = axis_B[i];
  }
  turn_end(X.R);
  return X;
}

}  // namespace trn
