#include "compensation/geometric.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/check.h"
#include "core/solve3.h"

namespace trn {

namespace {

constexpr int kSteps = 2;              // errors of 1e-3 shrink by their own square, or by 1e-3, in each
constexpr double kLambdaLeast = 1e-4;  // keeps the pole solvable when no tilt is known

}  // namespace

/// What the actual machine misses at some joints, and how the joints change it; all in M.
struct GeometricCorrection::Miss {
  Vec3 tip, axis;      ///< wanted less actual
  Mat3 tip_by_linear;  ///< derivative of `tip` by the linear joints
  Vec3 tip_by_rotary[2], axis_by_rotary[2];
};

GeometricCorrection::GeometricCorrection(const GeometricConfig& config) : config_(config) {
  int linear = 0;
  // Tip and tool axis are five equations. Three linear joints and two rotary ones solve them; with more there
  // would be a choice that the correction has no right to make.
  for (const auto* branch : {&config_.chain.tool, &config_.chain.work})
    for (const ActualAxis& axis : *branch) {
      if (axis.joint < 0) continue;
      if (axis.kind == JointKind::kLinear) {
        if (linear < 3) linear_[static_cast<std::size_t>(linear)] = axis.joint;
        ++linear;
      } else {
        if (rotary_count_ < 2) rotary_[static_cast<std::size_t>(rotary_count_)] = axis.joint;
        ++rotary_count_;
      }
    }
  if (linear != 3 || rotary_count_ > 2)
    throw std::invalid_argument("geometric errors need three linear and at most two rotary joints");
  lambda0_ = std::max(config_.chain.tilt_bound() / config_.limit_rad, kLambdaLeast);
}

GeometricCorrection::Miss GeometricCorrection::miss_at(const Wanted& wanted, const JointVec& q) const TRN_RT {
  TRN_CHECK(rotary_count_ >= 0 && rotary_count_ <= 2);
  ActualChain::Frames f;
  config_.chain.evaluate(q, f);
  // Both ends of the chain are seen from M: the point on the work that the tip shall touch goes with the
  // table, the tip goes with the tool. On the ideal machine they coincide.
  const Vec3 point = f.X_MB.p + f.X_MB.A * wanted.p_B, tip = f.X_MS.p - f.X_MS.A * wanted.tool_offset;
  const Vec3 u_wanted = (f.X_MB.A * wanted.u_B).normalized(), u = f.X_MS.A.col(2).normalized();
  Miss out;
  out.tip = point - tip;
  out.axis = u_wanted - u;
  for (std::size_t i = 0; i < 3; ++i) {
    const ActualChain::JointFrame& frame = f.joint[static_cast<std::size_t>(linear_[i])];
    // A joint of the table moves the point on the work, a joint of the tool moves the tip, which is
    // subtracted.
    out.tip_by_linear.col(static_cast<Eigen::Index>(i)) =
        frame.in_work_branch ? frame.axis : Vec3(-frame.axis);
  }
  for (int i = 0; i < rotary_count_; ++i) {
    const ActualChain::JointFrame& frame =
        f.joint[static_cast<std::size_t>(rotary_[static_cast<std::size_t>(i)])];
    const bool work = frame.in_work_branch;
    const Vec3 w = work ? frame.axis : Vec3(-frame.axis);
    out.tip_by_rotary[i] = w.cross((work ? point : tip) - frame.place);
    out.axis_by_rotary[i] = w.cross(work ? u_wanted : u);
  }
  return out;
}

double GeometricCorrection::damping2(const Miss& miss) const TRN_RT {
  const Vec3* c = miss.axis_by_rotary;
  // One rotary axis moves the tool axis by the sine of the angle between the two: 0 where the tool lies along
  // it.
  double gain2 = c[0].squaredNorm();
  if (rotary_count_ == 2) {
    // Determinant over trace: the smaller eigenvalue near the pole, smooth everywhere.
    const double a = c[0].squaredNorm(), b = c[1].squaredNorm(), d = c[0].dot(c[1]);
    gain2 = (a * b - d * d) / (a + b);
  }
  // The square of s / s0 in the formula of the header. Beyond it nothing is damped and the solution is exact.
  const double t2 = gain2 / (4 * lambda0_ * lambda0_);
  if (t2 >= 1) return 0;
  const double fade = (1 - t2) * (1 - t2);
  TRN_CHECK(t2 >= 0);
  return lambda0_ * lambda0_ * fade * fade;
}

void GeometricCorrection::step(const Miss& miss, double damping2, const JointVec& nominal,
                               JointVec& q) const TRN_RT {
  double turn[2] = {0, 0};
  if (config_.mode == GeometricMode::kFull && rotary_count_ > 0) {
    const Vec3* c = miss.axis_by_rotary;
    // The normal equations of the least squares in the header. The damping counts from the nominal angle and
    // not from the last step: otherwise each of the steps would take away a further share of it, and the pole
    // would be undamped in the end.
    const double b0 = -c[0].dot(miss.axis) - damping2 * (q[rotary_[0]] - nominal[rotary_[0]]);
    const double a00 = c[0].squaredNorm() + damping2;
    if (rotary_count_ == 1) {
      turn[0] = b0 / a00;
    } else {
      const double b1 = -c[1].dot(miss.axis) - damping2 * (q[rotary_[1]] - nominal[rotary_[1]]);
      const double a11 = c[1].squaredNorm() + damping2, a01 = c[0].dot(c[1]);
      // The determinant is 0 where both axes move the tool in the same direction, and is positive there by
      // the damping.
      const double det = a00 * a11 - a01 * a01;
      turn[0] = (b0 * a11 - b1 * a01) / det;
      turn[1] = (b1 * a00 - b0 * a01) / det;
    }
  }
  Vec3 tip = miss.tip;
  for (int i = 0; i < rotary_count_; ++i) {
    // The turns shift the tip, by tenths of a mm for a milliradian at the end of a long tool. The linear
    // joints make up for that in the same step.
    tip += turn[i] * miss.tip_by_rotary[i];
    q[rotary_[static_cast<std::size_t>(i)]] += turn[i];
  }
  Vec3 move;
  solve3(miss.tip_by_linear, tip, move);  // never flat: checked when the machine was put together
  for (int i = 0; i < 3; ++i) q[linear_[static_cast<std::size_t>(i)]] -= move[i];
}

bool GeometricCorrection::inside_limits(const JointVec& nominal, const JointVec& q) const TRN_RT {
  // Written so that a NaN is outside.
  for (const int i : linear_)
    if (!(std::abs(q[i] - nominal[i]) <= config_.limit_mm)) return false;
  for (int i = 0; i < rotary_count_; ++i) {
    const int joint = rotary_[static_cast<std::size_t>(i)];
    if (!(std::abs(q[joint] - nominal[joint]) <= config_.limit_rad)) return false;
  }
  return true;
}

KinStatus GeometricCorrection::correct(const Pose& X_BS, const Vec3& tool_offset, JointVec& q) const TRN_RT {
  TRN_CHECK(q.allFinite());
  TRN_CHECK(tool_offset.allFinite());
  const Wanted wanted{X_BS.p - X_BS.R * tool_offset, X_BS.R.col(2), tool_offset};
  const JointVec nominal = q;
  double damping = 0;
  // A fixed number of steps and no test for convergence: a test would let the number change from one place to
  // the next, and the joints' derivatives would have a jump there.
  for (int i = 0; i < kSteps; ++i) {
    const Miss miss = miss_at(wanted, q);
    // The damping is that of the nominal pose in all steps. If it changed on the way, the steps would run
    // after a target that moves.
    if (i == 0 && rotary_count_ > 0) damping = damping2(miss);
    step(miss, damping, nominal, q);
  }
  return inside_limits(nominal, q) ? KinStatus::kOk : KinStatus::kLimit;
}

KinStatus GeometricCorrection::actual(const JointVec& q, Pose& X_BS) const TRN_RT {
  ActualChain::Frames f;
  config_.chain.evaluate(q, f);
  // In the linear model A is not quite a rotation, so its transpose is not its inverse.
  const Mat3 A_BM = f.X_MB.A.inverse();
  X_BS = {A_BM * f.X_MS.A, A_BM * (f.X_MS.p - f.X_MB.p)};
  return std::isfinite(X_BS.p.sum() + X_BS.R.sum()) ? KinStatus::kOk : KinStatus::kUnreachable;
}

PoseResidual GeometricCorrection::residual(const Pose& X_BS, const Vec3& tool_offset,
                                           const JointVec& q) const {
  Pose X;
  actual(q, X);
  const Vec3 u = X.R.col(2), wanted = X_BS.R.col(2);
  // The angle by atan2: the arc cosine of a number next to 1 has lost half of its digits, and the tilts here
  // are arc seconds.
  return {((X.p - X.R * tool_offset) - (X_BS.p - X_BS.R * tool_offset)).norm(),
          std::atan2(u.cross(wanted).norm(), u.dot(wanted))};
}

}  // namespace trn
