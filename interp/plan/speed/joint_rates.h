#pragma once

#include <array>

#include "core/axes.h"

namespace trn::speed {

/// One value per motor joint, fixed size so that samples are plain data.
using PerJoint = std::array<double, kMaxJoints>;

/// What the time law may ask of the joints: limits with the reserve taken off; mm or rad and s.
struct JointRates {
  int count = 0;
  PerJoint velocity{}, acceleration{}, jerk{};
  PerJoint velocity_inverse{}, acceleration_inverse{}, jerk_inverse{};
};

/// The limits of `joints`, acceleration and jerk multiplied by their shares.
JointRates joint_rates(const Joints& joints, double acceleration_share, double jerk_share);

}  // namespace trn::speed
