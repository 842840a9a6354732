#pragma once

#include "core/axes.h"
#include "core/machine.h"
#include "core/realtime.h"
#include "kernel/s_curve.h"
#include "kernel/time_scale.h"

namespace trn {

/// A straight way of the joints from rest to rest that no plan has made: q(t) = from + way * curve(t). The
/// change to other corrections uses it. It takes a share of the joints' limits, and the rest lets the
/// override and a stop act at any moment (TimeScale).
class JointRamp {
 public:
  /// `shares`: of the joints' limits that it takes at full rate.
  JointRamp(const Joints& joints, double period_s, PlanShares shares = {0.9, 0.8});

  /// All joints move by `way` together, as fast as the slowest of them can.
  void begin_way(const JointVec& from, const JointVec& way, double rate) TRN_RT;

  /// One period with this target of the rate, 0 to 1; the joints at its end, mm or rad.
  JointVec step(double rate_target) TRN_RT;
  bool ended() const TRN_RT { return time_s_ >= curve_.duration_s(); }
  /// Of the way's own time, 0 to 1.
  double rate() const TRN_RT { return time_scale_.rate(); }

 private:
  const Joints joints_;
  PlanShares shares_;
  TimeScale time_scale_;
  SCurve curve_;
  JointVec from_, way_;
  double time_s_ = 0;
};

}  // namespace trn
