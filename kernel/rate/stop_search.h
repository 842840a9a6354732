#pragma once

#include <array>

#include "core/realtime.h"
#include "kernel/rate/rate_walk.h"
#include "kernel/rate_plan.h"

namespace trn {

/// Looks for a quick plan down to a lower rate, 0 to stop. It brakes as hard as each place allows, and
/// releases the brake (u > 0) when a share of the greatest u there would bring r' to 0 at the target. Where
/// that breaks a limit farther on, because a joint turns round or gathers speed there, it backtracks and
/// releases sooner until that place is passed, as often as its budget of steps allows.
class StopSearch {
 public:
  static constexpr double kMargin =
      0.015;  ///< of the range of u: the plan must still hold when it is followed

  /// `step_s_max`: longest step of a walk, s.
  explicit StopSearch(double step_s_max) : step_s_max_(step_s_max) {}

  /// Appends to the first plan.count steps, behind which `from` stands, and sets the rest of `plan` but
  /// `arrival`. `release_share`: of the greatest u, 0 to 1. `budget`: steps that may be taken, counted down.
  /// Returns the plan time from where the walk began, s; negative if no plan is found.
  double find(const RateWalk& from, double to, double release_share, int& budget, RatePlan& plan);

 private:
  bool advance(const RateWalk& here, const RateBounds& bounds, bool releasing, RateStep& step,
               RateWalk& next) const;
  bool backtrack(int behind, const RatePlan& plan);
  double brake(const RateWalk& walk, const RateBounds& bounds) const;
  double final_release(const RateBounds& bounds) const;

  double step_s_max_;
  double to_ = 0, release_share_ = 0;
  int at_ = 0, release_from_ = 0;  ///< steps
  double release_until_s_ = 0;     ///< of plan time passed
  int backtracks_left_ = 0;
  double deficit_share_ = 0;                                   ///< recovered in the next backtracking
  std::array<RateWalk, RatePlan::kStepsMax + 1> checkpoints_;  ///< where the steps begin
  std::array<bool, RatePlan::kStepsMax> released_;             ///< the brake is released in a step
};

}  // namespace trn
