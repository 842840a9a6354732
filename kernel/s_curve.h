#pragma once

#include "core/realtime.h"

namespace trn {

/// One joint from rest to rest over a distance in the least time under velocity, acceleration and jerk
/// limits: the seven-phase S-curve, in closed form.
class SCurve {
 public:
  SCurve() = default;
  SCurve(double distance, double velocity, double acceleration, double jerk) TRN_RT;

  double duration_s() const TRN_RT { return 4 * t_jerk_ + 2 * t_flat_ + t_cruise_; }
  /// Way gone at time t (clamped to the ends), mm or rad, signed.
  double at(double t_s) const TRN_RT;

 private:
  double ramp(double t_s) const TRN_RT;  ///< way of the accelerating half

  double t_jerk_ = 0, t_flat_ = 0, t_cruise_ = 0, jerk_ = 0, v_peak_ = 0, distance_ = 0;
};

}  // namespace trn
