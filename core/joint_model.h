#pragma once

#include <optional>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/realtime.h"

namespace trn {

/// What a joint's motor has to overcome. Linear joints in N and mm, rotary ones in Nm and rad.
struct JointModel {
  double inertia = 0;                           ///< N per mm/s^2, Nm per rad/s^2
  double viscous = 0;                           ///< N per mm/s, Nm per rad/s
  double coulomb = 0;                           ///< N, Nm, against the motion
  double coulomb_speed = 0;                     ///< mm/s, rad/s: below, friction grows evenly with the speed
  double gravity = 0;                           ///< N, Nm that holds the joint against its weight
  double imbalance_cos = 0, imbalance_sin = 0;  ///< Nm of a rotary joint, times cosine and sine of its place
  double cogging_pitch = 0;                     ///< mm, rad; 0: no table
  std::vector<double> cogging;                  ///< N, Nm at even places of a pitch, from 0; linear between

  /// The motor's force for this motion, N or Nm.
  double force(double q, double qd, double qdd) const TRN_RT;
  /// The part of it that does not move: weight and cogging.
  double force_at_rest(double q) const TRN_RT;
};

/// Section [feed_forward].
struct FeedForwardConfig {
  bool velocity = true, torque = true;
  /// The moment that the offsets are for, in periods behind that of the setpoint they go with.
  double delay_periods = -0.5;
  std::vector<std::optional<JointModel>> models;  ///< by joint; none: no torque is told in advance
};

/// Nothing: the config has no such section. ConfigError as ConfigTable.
std::optional<FeedForwardConfig> read_feed_forward(const Machine& machine);

}  // namespace trn
