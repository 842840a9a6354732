#pragma once

#include <array>

#include "core/realtime.h"
#include "kernel/plan_walk.h"

namespace trn {

/// A sequence of constant u over the segments ahead, verified against the joints' limits, that ends at a
/// constant rate.
struct Way {
  static constexpr double kMargin = 0.015;  ///< of the range of u: a way must hold when its turn comes
  std::array<RateStep, PlanWalk::kStepsMax> steps;
  int count = 0;
  int landing = 0;       ///< steps that lead to the target; 0: it does not go there
  double end_rate = 0;   ///< constant from there on
  double turn_rate = 0;  ///< where r' first becomes 0
  bool stops = false;    ///< leads to rest

  /// From the beginning of a step on, s.
  double time_s(int from) const TRN_RT;
};

/// Looks for a quick way down to a rate, 0 to stop. It brakes as hard as each place allows and comes off the
/// brake when a share of the greatest u there would bring r' to 0 at the target. Where that breaks a limit
/// farther on, because a joint turns round or gathers speed there, it goes back a little and comes off the
/// brake sooner until that place is passed, as often as it takes.
class WayDown {
 public:
  /// `step_s_max`: longest step of a walk, s.
  explicit WayDown(double step_s_max) : step_s_max_(step_s_max) {}

  /// Appends the way to the first way.count steps, behind which `from` stands, and sets the rest of `way` but
  /// `landing`. `early`: the share of the greatest u, 0 to 1. `work`: steps that may be taken, counted down.
  /// Returns the plan time from where the walk began, s; negative if none is found.
  double find(const PlanWalk& from, double to, double early, int& work, Way& way) TRN_RT;

 private:
  bool go_on(const PlanWalk& here, const RateBounds& bounds, bool off_the_brake, RateStep& step,
             PlanWalk& next) const TRN_RT;
  bool go_back(int behind, const Way& way) TRN_RT;
  double brake(const PlanWalk& walk, const RateBounds& bounds) const TRN_RT;
  double ease_of(const RateBounds& bounds) const TRN_RT;

  double step_s_max_;
  double to_ = 0, early_ = 0;
  int at_ = 0, off_from_ = 0;                            ///< steps
  double off_until_s_ = 0;                               ///< of plan time passed
  std::array<PlanWalk, PlanWalk::kStepsMax + 1> marks_;  ///< where the steps begin
  std::array<bool, PlanWalk::kStepsMax> off_;            ///< off the brake in a step
};

}  // namespace trn
