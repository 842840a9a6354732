#pragma once

#include "core/axes.h"
#include "core/realtime.h"

namespace trn {

/// Three equal low passes in a row: any sequence of targets inside [-limit, limit] becomes a motion whose
/// differences by the period stay inside the given velocity, acceleration and jerk. The time constant is the
/// smallest for which the worst sequence of targets (absolute sum of the differenced impulse response) does.
class OffsetFilter {
 public:
  OffsetFilter() = default;
  /// `limit` is the greatest offset, above 0, in mm, rad, or 1 for a share; the other limits are per s, s^2
  /// and s^3 of the same unit. It begins at rest with an offset of 0.
  OffsetFilter(double limit, double velocity, double acceleration, double jerk, double period_s);

  /// One period towards `target`; what is not finite counts as no change of the target.
  double step(double target) TRN_RT;
  double value() const TRN_RT { return z_[2]; }
  /// Moves target and state alike by `jump`, at once: what jumped elsewhere is taken up here.
  void shift(double jump) TRN_RT;
  double time_constant_s() const TRN_RT { return tau_s_; }

 private:
  double limit_ = 0, gain_ = 1, tau_s_ = 0, target_ = 0;
  double z_[3] = {0, 0, 0};
};

}  // namespace trn
