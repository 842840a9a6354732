#pragma once

#include <array>

#include "core/realtime.h"
#include "kernel/rate_walk.h"

namespace trn {

/// Steps of constant u over the segments ahead, verified against the joints' limits, that end at a constant
/// rate.
struct RatePlan {
  static constexpr double kMargin =
      0.015;  ///< of the range of u: the plan must still hold when it is followed
  std::array<RateStep, RateWalk::kStepsMax> steps;
  int count = 0;
  int arrival = 0;        ///< steps that lead to the target; 0: it does not go there
  double end_rate = 0;    ///< constant from there on
  double level_rate = 0;  ///< where r' first becomes 0
  bool stops = false;     ///< leads to rest

  /// From the beginning of a step on, s.
  double time_s(int from) const TRN_RT;
};

/// Looks for a quick plan down to a lower rate, 0 to stop. It brakes as hard as each place allows, and
/// releases the brake (u > 0) when a share of the greatest u there would bring r' to 0 at the target. Where
/// that breaks a limit farther on, because a joint turns round or gathers speed there, it backtracks and
/// releases sooner until that place is passed, as often as its budget of steps allows.
class StopSearch {
 public:
  /// `step_s_max`: longest step of a walk, s.
  explicit StopSearch(double step_s_max) : step_s_max_(step_s_max) {}

  /// Appends to the first plan.count steps, behind which `from` stands, and sets the rest of `plan` but
  /// `arrival`. `release_share`: of the greatest u, 0 to 1. `budget`: steps that may be taken, counted down.
  /// Returns the plan time from where the walk began, s; negative if no plan is found.
  double find(const RateWalk& from, double to, double release_share, int& budget, RatePlan& plan) TRN_RT;

 private:
  bool advance(const RateWalk& here, const RateBounds& bounds, bool releasing, RateStep& step,
               RateWalk& next) const TRN_RT;
  bool backtrack(int behind, const RatePlan& plan) TRN_RT;
  double brake(const RateWalk& walk, const RateBounds& bounds) const TRN_RT;
  double final_release(const RateBounds& bounds) const TRN_RT;

  double step_s_max_;
  double to_ = 0, release_share_ = 0;
  int at_ = 0, release_from_ = 0;                              ///< steps
  double release_until_s_ = 0;                                 ///< of plan time passed
  std::array<RateWalk, RateWalk::kStepsMax + 1> checkpoints_;  ///< where the steps begin
  std::array<bool, RateWalk::kStepsMax> released_;             ///< off the brake in a step
};

}  // namespace trn
