#pragma once

#include <array>
#include <memory>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/newton.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

/// One rail with its parallelogram link; mm.
struct Rail {
  Vec3 rail_R = Vec3::Zero();        ///< a_i, where the rail's zero lies
  Vec3 direction_R = Vec3::UnitX();  ///< d_i, unit
  Vec3 platform_P = Vec3::Zero();    ///< b_i, the link's joint on the platform
  double link_mm = 0;                ///< l_i
  double offset_mm = 0;              ///< c_i
  double sign = 1;                   ///< which side of the platform the slider was assembled on
};

struct RailMillConfig {
  PlatformConfig platform;
  std::array<Rail, 4> rails;
};

/// Four sliders, four links, a platform that moves in x, y, z and turns about x by alpha:
/// q_i = -c_i + d_i.v_i +- sqrt(l_i^2 - v_i.(I - d_i d_i^T) v_i), v_i = p + Rx(alpha) b_i - a_i
/// (docs/sources.md S4.1).
class RailMill final : public PlatformKinematics {
 public:
  using Square = Eigen::Matrix<double, 4, 4>;

  explicit RailMill(const RailMillConfig& config);

  KinStatus actuators(const Pose& X_RP, JointVec& q) const TRN_RT override;
  KinStatus platform(const JointVec& q, Pose& X_RP) const TRN_RT override;
  double conditioning(const Pose& X_RP) const TRN_RT override;

  /// Slider speeds (mm/s) = J * [velocity of P's origin (mm/s); turn about x (rad/s)]; not finite where a
  /// link stands square to its rail.
  Square rail_jacobian(const Pose& X_RP) const TRN_RT;
  /// The least sqrt(...) of the formula over its link's length: 0 where a link stands square to its rail, < 0
  /// out of reach. No unit.
  double reach(const Pose& X_RP) const TRN_RT;

 private:
  /// Newton from `X_RP`; kUnreachable also for a root of another assembly.
  KinStatus follow(const JointVec& q, Pose& X_RP) const TRN_RT;

  RailMillConfig config_;
  JointVec home_q_;
  double radius_ = 1;  ///< mean |b_i|
};

/// [[kinematics.rail]] four times with rail_mm, direction, platform_mm, link_mm, sign and optional offset_mm.
std::unique_ptr<Kinematics> make_rail_mill(const Machine& machine, const ConfigTable& section);

}  // namespace trn
