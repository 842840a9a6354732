#include "kinematics/serial/serial_kinematics.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/solve3.h"
#include "core/units.h"
#include "kinematics/finite.h"

namespace trn {

namespace {

// The seed's rotary joints are kept if they point the tool along the wanted axis to within this.
constexpr double kSameDirection = 1e-14;
// Volume of the three linear directions below which they no longer reach every point.
constexpr double kFlat = 1e-9;
// Linear joints that do not span the space: least squares, damped. Each step leaves the damping's share of
// what can be reached.
constexpr double kDamping = 1e-6;
constexpr int kLinearSteps = 3;
constexpr double kReached = 1e-10;  // of the way, and at least as many mm

bool is_rotary_word(int word) TRN_RT { return word >= kA; }

}  // namespace

SerialKinematics::SerialKinematics(const SerialConfig& config)
    : config_(config),
      rotary_(config.chain.end().col(2)),
      joint_count_(static_cast<int>(config.joints.size())) {
  TRN_CHECK(config.joints.size() <= kMaxJoints);
  int linear = 0;
  for (int i = 0; i < config_.chain.size(); ++i) {
    const ChainStep& step = config_.chain.step(i);
    TRN_CHECK(step.joint >= 0 && step.joint < joint_count_);
    word_mask_ |= 1u << config_.words[step.joint].word;
    if (step.kind == JointKind::kRotary) {
      const int n = rotary_.count();
      if (n < RotaryAxes::kMax) rotary_joint_[n] = step.joint;
      if (!rotary_.add_axis(step.axis)) rotary_closed_ = false;
      // A fourth linear joint, such as a quill beside Z, leaves a choice that the closed form cannot make. It
      // is counted, and `closed_form_` is then false.
    } else if (linear++ < 3) {
      linear_joint_[linear - 1] = step.joint;
    }
  }
  const JointVec zero = JointVec::Zero(joint_count_);
  // Three linear joints in one plane reach no space. At home this is a mistake of the machine's description;
  // where rotary joints carry linear ones it may also happen on the way, and `linear_joints` looks again.
  const SerialChain::Sweep home = config_.chain.sweep(zero);
  closed_form_ = rotary_closed_ && linear == 3 && std::abs(home.columns.determinant()) > kFlat;
}

JointVec SerialKinematics::joints_of(const Vec3& abc) const TRN_RT {
  JointVec q = JointVec::Zero(joint_count_);
  for (int i = 0; i < joint_count_; ++i)
    if (const WordOfJoint& word = config_.words[i]; is_rotary_word(word.word))
      q[i] = word.sense * abc[word.word - kA];
  return q;
}

Mat3 SerialKinematics::orientation(const Vec3& abc) const TRN_RT {
  return config_.chain.rotation(joints_of(abc));
}

double SerialKinematics::overtravel(const RotaryAxes::Angles& angles) const TRN_RT {
  double sum = 0;
  for (int i = 0; i < rotary_.count(); ++i) {
    const JointLimit& limit = config_.joints[rotary_joint_[i]].limit;
    sum += std::max({0.0, limit.min - angles[i], angles[i] - limit.max});
  }
  return sum;
}

void SerialKinematics::into_limits(RotaryAxes::Angles& angles) const TRN_RT {
  for (int i = 0; i < rotary_.count(); ++i) {
    const JointLimit& limit = config_.joints[rotary_joint_[i]].limit;
    // Whole turns only, as many as are missing: a C axis of -360 to 360 degrees whose nearest answer is 370
    // goes to 10. What no whole turn brings inside stays, for the limits' own check to refuse by name.
    const double over = std::max(0.0, angles[i] - limit.max), under = std::max(0.0, limit.min - angles[i]);
    const double turned = angles[i] + 2 * kPi * (std::ceil(under / (2 * kPi)) - std::ceil(over / (2 * kPi)));
    if (turned >= limit.min && turned <= limit.max) angles[i] = turned;
  }
}

KinStatus SerialKinematics::words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT {
  abc = seed_abc.allFinite() ? seed_abc : Vec3::Zero();
  const double length = u_B.norm();
  if (!u_B.allFinite() || !(length > kUnitTolerance) || !std::isfinite(length))
    return KinStatus::kUnreachable;
  const Vec3 u = u_B / length;
  JointVec q = joints_of(abc);
  if ((config_.chain.rotation(q).col(2) - u).norm() < kSameDirection) return KinStatus::kOk;
  if (!rotary_closed_) {
    // The tool's own turn is free: the present frame is turned by the shortest way.
    const Pose X = config_.chain.pose(q);
    const Mat3 turned = turn_between(X.R.col(2), u) * X.R;
    const KinStatus status = solve_by_newton(config_.chain, {turned, X.p}, q);
    if (status != KinStatus::kOk) return status;
  } else {
    const RotaryAxes::Angles seed{q[rotary_joint_[0]], q[rotary_joint_[1]]};
    RotaryAxes::Solutions found = rotary_.solve(u, seed);
    if (found.count == 0) return KinStatus::kUnreachable;
    for (int i = 0; i < found.count; ++i) into_limits(found.angles[i]);
    // A radian of overtravel outweighs any way to the seed. Where both answers are inside, the nearer one
    // goes on in the same branch.
    const auto cost = [&](const RotaryAxes::Angles& angles) {
      return overtravel(angles) * 1e6 + distance2(angles, seed);  // inside the limits first, then the nearest
    };
    const int best = found.count == 2 && cost(found.angles[1]) < cost(found.angles[0]) ? 1 : 0;
    for (int i = 0; i < rotary_.count(); ++i) q[rotary_joint_[i]] = found.angles[best][i];
  }
  for (int i = 0; i < joint_count_; ++i)
    if (const WordOfJoint& word = config_.words[i]; is_rotary_word(word.word))
      abc[word.word - kA] = word.sense * q[i];
  return KinStatus::kOk;
}

KinStatus SerialKinematics::forward(const JointVec& q, Pose& X_BS) const TRN_RT {
  X_BS = {};
  if (q.size() != joint_count_ || !q.allFinite()) return KinStatus::kUnreachable;
  const Pose X = config_.chain.pose(q);
  if (!is_pose(X)) return KinStatus::kUnreachable;
  X_BS = X;
  return KinStatus::kOk;
}

KinStatus SerialKinematics::inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT {
  q = usable_seed(seed, joint_count_);
  if (!is_pose(X_BS)) return KinStatus::kUnreachable;
  if (closed_form_) return inverse_closed(X_BS, q);
  JointVec solved = q;
  const KinStatus status = solve_by_newton(config_.chain, X_BS, solved);
  if (status == KinStatus::kOk) q = solved;
  return status;
}

KinStatus SerialKinematics::inverse_closed(const Pose& X_BS, JointVec& q) const TRN_RT {
  const Vec3 u = X_BS.R.col(2);
  SerialChain::Sweep at = config_.chain.sweep(q);
  if ((at.R.col(2) - u).squaredNorm() > kSameDirection * kSameDirection) {
    const int last = rotary_.count() - 1;
    const RotaryAxes::Angles seed{last >= 0 ? q[rotary_joint_[0]] : 0.0,
                                  last >= 1 ? q[rotary_joint_[1]] : 0.0};
    const RotaryAxes::Solutions found = rotary_.solve(u.normalized(), seed);
    if (found.count == 0) return KinStatus::kUnreachable;
    const bool second =
        found.count == 2 && distance2(found.angles[1], seed) < distance2(found.angles[0], seed);
    for (int i = 0; i <= last; ++i) q[rotary_joint_[i]] = found.angles[second ? 1 : 0][i];
    at = config_.chain.sweep(q);
  }
  return linear_joints(at, X_BS.p, q);
}

// The linear joints that bring the spindle to p_BS, the rotary ones being as in the sweep.
KinStatus SerialKinematics::linear_joints(const SerialChain::Sweep& at, const Vec3& p_BS,
                                          JointVec& q) const TRN_RT {
  Vec3 linear;
  // The columns are unit vectors, so the determinant is the volume that they span, 1 for three axes square to
  // each other, whatever the size of the machine.
  if (std::abs(solve3(at.columns, p_BS - at.p, linear)) < kFlat) return KinStatus::kSingular;
  if (!std::isfinite(linear.sum())) return KinStatus::kUnreachable;
  for (int i = 0; i < 3; ++i) q[linear_joint_[i]] = linear[i];
  return KinStatus::kOk;
}

// The words are the rotary joints, so one sweep serves the pose and the answer.
KinStatus SerialKinematics::joints_at_tip(const Vec3& abc, const Vec3& p_BT, const Vec3& tool_offset,
                                          const JointVec&, Pose& X_BS, JointVec& q) const TRN_RT {
  q = JointVec::Zero(joint_count_);
  X_BS = {};
  if (!abc.allFinite() || !p_BT.allFinite() || !tool_offset.allFinite()) return KinStatus::kUnreachable;
  q = joints_of(abc);
  if (!closed_form_) return open_joints_at_tip(p_BT, tool_offset, X_BS, q);
  const SerialChain::Sweep at = config_.chain.sweep(q);
  X_BS = {at.R, p_BT + at.R * tool_offset};
  return linear_joints(at, X_BS.p, q);
}

// The same for any chain. The rotary joints stand where their words say, also where the pose leaves them a
// choice (three of them, or two about one axis) and where the linear joints do not reach every point, as on a
// lathe: there a word must not be dropped to bring the tip to its place. What the linear joints cannot reach
// remains in the residual.
KinStatus SerialKinematics::open_joints_at_tip(const Vec3& p_BT, const Vec3& tool_offset, Pose& X_BS,
                                               JointVec& q) const TRN_RT {
  SerialChain::Jacobian J;
  const Pose at = config_.chain.pose_and_jacobian(q, J);
  X_BS = {at.R, p_BT + at.R * tool_offset};
  Mat3 squares = kDamping * Mat3::Identity();
  for (int i = 0; i < joint_count_; ++i)
    if (config_.joints[i].kind == JointKind::kLinear)
      squares += J.col(i).head<3>() * J.col(i).head<3>().transpose();
  const Eigen::LLT<Mat3> factor(squares);
  Vec3 missing = X_BS.p - at.p;
  const double size = 1 + missing.norm();
  for (int k = 0; k < kLinearSteps; ++k) {
    const Vec3 weights = factor.solve(missing);
    for (int i = 0; i < joint_count_; ++i) {
      if (config_.joints[i].kind != JointKind::kLinear) continue;
      const double step = J.col(i).head<3>().dot(weights);
      q[i] += step;
      missing -= step * J.col(i).head<3>();
    }
  }
  return missing.norm() < kReached * size ? KinStatus::kOk : KinStatus::kUnreachable;
}

KinStatus SerialKinematics::joints_from_words(const Words& words, JointVec& q) const TRN_RT {
  q = JointVec::Zero(joint_count_);
  if (!words.allFinite()) return KinStatus::kUnreachable;
  for (int i = 0; i < joint_count_; ++i) q[i] = config_.words[i].sense * words[config_.words[i].word];
  return KinStatus::kOk;
}

KinStatus SerialKinematics::words_from_joints(const JointVec& q, Words& words) const TRN_RT {
  words.setZero();
  if (q.size() != joint_count_ || !q.allFinite()) return KinStatus::kUnreachable;
  for (int i = 0; i < joint_count_; ++i) words[config_.words[i].word] = config_.words[i].sense * q[i];
  return KinStatus::kOk;
}

}  // namespace trn
