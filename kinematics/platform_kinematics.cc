#include "kinematics/platform_kinematics.h"

#include <cmath>

#include "core/check.h"
#include "kinematics/finite.h"

namespace trn {

namespace {

constexpr double kSameAxis = 1e-14;  // the seed's words are kept if they point the tool this well

/// Tilts of a frame whose turn about its own Z does not matter: R z = Rx(A) Ry(B) z.
Vec3 tilts_of(const Vec3& u) TRN_RT {
  return {std::atan2(-u.y(), u.z()), std::atan2(u.x(), std::hypot(u.y(), u.z())), 0.0};
}

}  // namespace

PlatformConfig read_platform(const ConfigTable& section) {
  PlatformConfig config;
  config.carries_work = section.choice("carries", {"work", "spindle"}) == "work";
  config.spindle_mm = section.vec3("spindle_mm");
  config.home_X_RP = translation(section.vec3("home_mm"));
  config.conditioning_min = section.number("conditioning_min", 0.0, Range{0.0, 1.0});
  return config;
}

PlatformKinematics::PlatformKinematics(const PlatformConfig& config, int joint_count, int tilt_count)
    : config_(config), joint_count_(joint_count), tilt_count_(tilt_count) {
  TRN_CHECK(joint_count >= 1 && static_cast<std::size_t>(joint_count) <= kMaxJoints);
  TRN_CHECK(tilt_count == 1 || tilt_count == 2);
  tilts_.add_axis(Vec3::UnitX());
  if (tilt_count == 2) tilts_.add_axis(Vec3::UnitY());
}

unsigned PlatformKinematics::word_mask() const TRN_RT {
  const unsigned tilts = tilt_count_ == 2 ? (1u << kA | 1u << kB) : 1u << kA;
  return 1u << kX | 1u << kY | 1u << kZ | tilts;
}

Mat3 PlatformKinematics::orientation(const Vec3& abc) const TRN_RT {
  return tilt_count_ == 2 ? Mat3(rot_x(abc[0]) * rot_y(abc[1])) : rot_x(abc[0]);
}

KinStatus PlatformKinematics::words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT {
  abc = seed_abc.allFinite() ? seed_abc : Vec3::Zero();
  const double length = u_B.norm();
  if (!u_B.allFinite() || !(length > kUnitTolerance) || !std::isfinite(length))
    return KinStatus::kUnreachable;
  const Vec3 u = u_B / length;
  // A program that repeats its angles must get them back to the last bit. Solving anew would return them with
  // a rounding error, and the rotary words would seem to move.
  if ((orientation(abc).col(2) - u).norm() < kSameAxis) return KinStatus::kOk;
  const RotaryAxes::Angles seed{abc[0], abc[1]};
  const RotaryAxes::Solutions found = tilts_.solve(u, seed);
  if (found.count == 0) return KinStatus::kUnreachable;
  TRN_CHECK(found.count <= 2);
  // Two pairs of tilts give the same axis. The nearer one to the seed is taken, so that a path goes on in the
  // branch in which it began.
  const bool second = found.count == 2 && distance2(found.angles[1], seed) < distance2(found.angles[0], seed);
  for (int i = 0; i < tilt_count_; ++i) abc[i] = found.angles[second ? 1 : 0][i];
  return KinStatus::kOk;
}

Pose PlatformKinematics::platform_from_spindle(const Pose& X_BS) const TRN_RT {
  const Pose X_CS = translation(config_.spindle_mm);  // spindle in its carrier: R or P
  // A table is B itself, so X_RP = X_RS X_SB, with the spindle fast in the base. A platform with the spindle
  // has B = R, so X_RP = X_RS X_SP.
  return config_.carries_work ? X_CS * trn::inverse(X_BS) : X_BS * trn::inverse(X_CS);
}

Pose PlatformKinematics::spindle_from_platform(const Pose& X_RP) const TRN_RT {
  const Pose X_CS = translation(config_.spindle_mm);
  return config_.carries_work ? trn::inverse(X_RP) * X_CS : X_RP * X_CS;
}

KinStatus PlatformKinematics::forward(const JointVec& q, Pose& X_BS) const TRN_RT {
  X_BS = {};
  if (q.size() != joint_count_ || !q.allFinite()) return KinStatus::kUnreachable;
  Pose X_RP;
  const KinStatus status = platform(q, X_RP);
  if (status != KinStatus::kOk) return status;
  X_BS = spindle_from_platform(X_RP);
  return KinStatus::kOk;
}

/// The same tip and axis with the turn about the tool that the words stand for.
Pose PlatformKinematics::without_turn(const Pose& X_BS) const TRN_RT {
  return {orientation(tilts_of(X_BS.R.col(2))), X_BS.p};
}

// The joints are written only when there is an answer. A pose at a limit or near a singularity still gets its
// joints, so that reports can show how far it is off.
KinStatus PlatformKinematics::solve(const Pose& X_RP, JointVec& q) const TRN_RT {
  JointVec solved = q;
  const KinStatus status = actuators(turns_freely() ? turned(X_RP) : X_RP, solved);
  if (status == KinStatus::kUnreachable || !solved.allFinite()) return KinStatus::kUnreachable;
  q = solved;
  return status;
}

KinStatus PlatformKinematics::inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT {
  q = usable_seed(seed, joint_count_);
  if (!is_rigid(X_BS)) return KinStatus::kUnreachable;
  return solve(platform_from_spindle(turns_freely() ? without_turn(X_BS) : X_BS), q);
}

Pose PlatformKinematics::platform_from_words(const Words& words) const TRN_RT {
  // With RTCP off the words are the machine's own axes: a tilt turns the platform about its own origin, and
  // the tip leaves its place.
  const Mat3 R_BS = orientation(words.tail<3>());
  const Vec3 away = words.head<3>() - config_.spindle_mm;  // origin of P, upright: -away or away
  return config_.carries_work ? Pose{R_BS.transpose(), -away} : Pose{R_BS, away};
}

KinStatus PlatformKinematics::joints_from_words(const Words& words, JointVec& q) const TRN_RT {
  q = JointVec::Zero(joint_count_);
  if (!words.allFinite()) return KinStatus::kUnreachable;
  return solve(platform_from_words(words), q);
}

KinStatus PlatformKinematics::words_from_joints(const JointVec& q, Words& words) const TRN_RT {
  words.setZero();
  if (q.size() != joint_count_ || !q.allFinite()) return KinStatus::kUnreachable;
  Pose X_RP;
  const KinStatus status = platform(q, X_RP);
  if (status != KinStatus::kOk) return status;
  // A machine that turns about its tool to suit its legs may stand at any such turn. The words have none, so
  // it is taken out before they are read off the platform's place.
  if (turns_freely()) X_RP = platform_from_spindle(without_turn(spindle_from_platform(X_RP)));
  // R of a table is the transpose of the tool's orientation in the work (docs/sources.md S3.2), and the tool
  // axis in the table is then its third row.
  const Vec3 u_B = config_.carries_work ? Vec3(X_RP.R.row(2)) : Vec3(X_RP.R.col(2));
  const Vec3 away = config_.carries_work ? Vec3(-X_RP.p) : X_RP.p;
  words << away + config_.spindle_mm, tilts_of(u_B);
  return KinStatus::kOk;
}

}  // namespace trn
