#pragma once

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/serial/rotary_axes.h"

namespace trn {

/// What machines with a moving platform P share: who carries what, and the words. The base is R = M.
/// carries = "work":    the platform is the table, B = P; the spindle stands still in the base.
/// carries = "spindle": the platform holds the spindle; the work lies on the base, B = R.
/// The spindle is not turned against its carrier, so its axis is Z of the frame it is fixed in.
struct PlatformConfig {
  bool carries_work = true;
  Vec3 spindle_mm = Vec3::Zero();  ///< gauge point S: in R (carries work) or in P (carries spindle)
  Pose home_X_RP;                  ///< where Newton starts; upright
  double conditioning_min = 0;     ///< below it a pose is kSingular; 0: not judged
};

/// Reads the keys carries, spindle_mm, home_mm and conditioning_min.
PlatformConfig read_platform(const ConfigTable& section);

/// A parallel machine. Derived classes know only the platform: pose X_RP <-> actuators.
/// Words A, B tilt the tool against the work, R_WT = Rx(A) Ry(B), turn about the tool 0 (docs/sources.md
/// S3.2). RTCP off: X Y Z place the platform as it would stand upright, gauge point S at (X, Y, Z) of the
/// table frame; a tilt then turns it about its own origin. So, upright, the words mean the same with RTCP on
/// and off, and for a table X+ moves the platform along -X: the tool goes X+ over the work.
class PlatformKinematics : public Kinematics {
 public:
  int joint_count() const TRN_RT override { return joint_count_; }
  unsigned word_mask() const TRN_RT override;
  /// Words at zero: the gauge point lies in the table frame's origin, upright.
  Pose home_X_BM() const TRN_RT override { return {}; }
  Mat3 orientation(const Vec3& abc) const TRN_RT override;
  KinStatus words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT override;
  KinStatus forward(const JointVec& q, Pose& X_BS) const TRN_RT override;
  KinStatus inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT override;
  KinStatus joints_from_words(const Words& words, JointVec& q) const TRN_RT override;
  KinStatus words_from_joints(const JointVec& q, Words& words) const TRN_RT override;

  /// The platform at home, upright.
  const Pose& home() const TRN_RT { return config_.home_X_RP; }
  /// RTCP off: the platform that these words ask for.
  Pose platform_from_words(const Words& words) const TRN_RT;
  Pose platform_from_spindle(const Pose& X_BS) const TRN_RT;
  Pose spindle_from_platform(const Pose& X_RP) const TRN_RT;

  /// Platform pose -> actuators; q is undefined unless kOk, kSingular or kLimit.
  virtual KinStatus actuators(const Pose& X_RP, JointVec& q) const TRN_RT = 0;
  /// Actuators -> platform pose, by Newton from the home pose.
  virtual KinStatus platform(const JointVec& q, Pose& X_RP) const TRN_RT = 0;
  /// 1: every direction is as stiff as any other; 0: singular. No unit.
  virtual double conditioning(const Pose& X_RP) const TRN_RT = 0;

 protected:
  /// True: inverse uses only R_BS's third column and chooses the turn about the tool by `turned`.
  virtual bool turns_freely() const TRN_RT { return false; }
  /// The platform turned about the tool as suits the machine; X_RP has turn 0.
  virtual Pose turned(const Pose& X_RP) const TRN_RT { return X_RP; }
  /// tilt_count 1: word A only; 2: A and B.
  PlatformKinematics(const PlatformConfig& config, int joint_count, int tilt_count);

 private:
  Pose without_turn(const Pose& X_BS) const TRN_RT;
  KinStatus solve(const Pose& X_RP, JointVec& q) const TRN_RT;

  PlatformConfig config_;
  int joint_count_, tilt_count_;
  RotaryAxes tilts_;
};

}  // namespace trn
