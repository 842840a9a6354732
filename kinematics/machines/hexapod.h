#pragma once

#include <array>
#include <limits>
#include <memory>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/newton.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

/// Geometry and limits of six legs; mm and rad.
struct HexapodConfig {
  PlatformConfig platform;
  std::array<Vec3, 6> base_R;      ///< joint A_i in the base
  std::array<Vec3, 6> platform_P;  ///< joint B_i in the platform
  double joint_angle_max =
      std::numeric_limits<double>::infinity();  ///< of a leg from its home direction, both ends
  double leg_distance_min = 0;                  ///< between the centre lines of two legs; 0: not judged
  double free_turn_max = 0;                     ///< about the tool, to balance the legs; 0: no such turn
};

/// Six legs between base and platform: leg i = |p + R B_i - A_i| (docs/sources.md S3.1).
class Hexapod final : public PlatformKinematics {
 public:
  using Square = Eigen::Matrix<double, 6, 6>;

  explicit Hexapod(const HexapodConfig& config);

  KinStatus actuators(const Pose& X_RP, JointVec& q) const TRN_RT override;
  KinStatus platform(const JointVec& q, Pose& X_RP) const TRN_RT override;
  double conditioning(const Pose& X_RP) const TRN_RT override;

  /// Newton from a pose of the caller's, as for tracking; X_RP is start and answer.
  NewtonReport platform_from(const JointVec& q, Pose& X_RP) const TRN_RT;
  /// Leg speeds (mm/s) = J * [velocity of P's origin (mm/s); angular velocity (rad/s)], both in the base.
  Square leg_jacobian(const Pose& X_RP) const TRN_RT;
  /// The largest angle (rad) of any leg end from where it points at home.
  double joint_angle(const Pose& X_RP) const TRN_RT;
  /// The turn about the tool (rad, right-handed about the axis, within free_turn_max) that makes the legs
  /// most alike: it minimizes the variance of their squared lengths. A smooth function of the pose, whose own
  /// turn counts as 0. Any turn keeps tip and axis.
  double balancing_turn(const Pose& X_RP) const TRN_RT;
  /// The least distance (mm) between the centre lines of two legs.
  double leg_distance(const Pose& X_RP) const TRN_RT;

 private:
  Vec3 leg(const Pose& X_RP, int i) const TRN_RT;
  bool turns_freely() const TRN_RT override { return config_.free_turn_max > 0; }
  Pose turned(const Pose& X_RP) const TRN_RT override;

  HexapodConfig config_;
  std::array<Vec3, 6> home_direction_;  ///< unit, base to platform; the home pose is upright: in R and in P
  double radius_ = 1;                   ///< mean |B_i|, the length that makes a turn comparable to a shift
};

/// [[kinematics.leg]] six times with base_mm and platform_mm; optional joint_angle_deg_max,
/// leg_distance_mm_min.
std::unique_ptr<Kinematics> make_hexapod(const Machine& machine, const ConfigTable& section);

}  // namespace trn
