#pragma once

#include <array>

#include "core/axes.h"
#include "core/realtime.h"

namespace trn {

/// Shares of the joint limits that a motion uses; the rest lets the time scale act at once.
struct PlanShares {
  double acceleration = 0.99;
  double jerk = 0.98;
  double velocity = 1;
};

/// Override and stop of a motion of which only its shares of the limits are known, as a jog: a rate r =
/// d(plan time)/dt in [0, 1] with bounded second derivative.
///
/// With r, r', r'' a joint that the plan moves by v, a, j moves by r v, r^2 a + r' v and
/// r^3 j + 3 r r' a + r'' v. For every plan inside the shares these stay inside the limits if
///   |r'| k_a <= 1 - alpha r^2   and   3 r |r'| alpha k_aj + |r''| k_j <= 1 - beta r^3
/// with k_a = max V/A, k_aj = max A/J, k_j = max V/J over the joints, V with its share, and alpha, beta those
/// of acceleration and jerk: no knowledge of the plan is needed, so a hold may come at any tick. The fastest
/// law inside these bounds is a curve w(r) of the rate's speed, computed once.
class TimeScale {
 public:
  TimeScale(const Joints& joints, PlanShares shares, double period_s);

  /// Target rate, 0 (stand) to 1 (as planned); takes effect with the next step.
  void set_target(double rate) TRN_RT;

  /// One period; returns the plan time that passes in it, s.
  double step() TRN_RT;

  double rate() const TRN_RT { return rate_; }
  bool at_target() const TRN_RT { return rate_ == target_ && slope_ == 0; }

  /// At rest, take the target rate without a ramp: the plan's own start is the ramp.
  void restart() TRN_RT;

 private:
  static constexpr int kCells = 512;  ///< of the rate's range

  double speed_limit(double rate) const TRN_RT;                       ///< w(r)
  double acceleration_limit(double rate, double speed) const TRN_RT;  ///< bound of |r''|
  double approach_speed(double distance) const TRN_RT;

  double k_a_ = 0, k_aj_ = 0, k_j_ = 0, alpha_, beta_, period_s_;
  std::array<double, kCells + 1> speed_{};  // w at r = i / kCells
  double rate_ = 1, slope_ = 0, target_ = 1;
};

}  // namespace trn
