#pragma once

#include "core/realtime.h"
#include "kernel/rate_plan.h"

namespace trn {

/// The rate of the planned motion, r = d(plan time)/dt from 0 (stand) over 1 (as planned) to 2: follows the
/// rate plan in force, and decides nothing.
class RateFollower {
 public:
  explicit RateFollower(double period_s) : period_s_(period_s) {}

  /// The motion is at rest: begin with this rate (at most 1), without a ramp; the path's own start is the
  /// ramp.
  void restart(double rate) TRN_RT;
  /// From now on this plan, which begins with the present rate and slope.
  void adopt(const RatePlan& plan) TRN_RT;
  /// One period; returns the plan time that passes in it, s.
  double step() TRN_RT;

  const RatePlan& plan() const TRN_RT { return plan_; }
  const RateState& state() const TRN_RT { return state_; }
  double rate() const TRN_RT { return state_.rate; }
  bool standing() const TRN_RT { return state_.standing(); }
  /// Plan time that passed in the first part (0 to 1) of the last period, s.
  double plan_time_at(double part) const TRN_RT;

 private:
  double period_s_;
  RatePlan plan_;
  RateState state_, before_;  ///< before the last period
};

}  // namespace trn
