#pragma once

#include <array>

#include "core/axes.h"
#include "core/motion.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plan.h"

namespace trn {

/// The joints' limits over their jerk limits, as in JointMotion: A/J in s, V/J in s^2.
struct PlanLimits {
  explicit PlanLimits(const Joints& joints, double period_s);
  int count = 0;
  std::array<double, kMaxJoints> acceleration{}, velocity{};
  double u_max = 0;       ///< bound of |u| where nothing moves, 1/s^2
  double step_s_max = 0;  ///< of a walk's step, so that bounds at its ends hold in between
};

/// What the joints' limits leave to the rate at one place: bounds of u and of r' there, by (P14) to (P16) of
/// docs/planner.md.
struct RateBounds {
  double u_min, u_max, slope_min, slope_max;
  bool legal;      ///< false: too fast, or no u serves all joints
  double u_still;  ///< bound of |u| with the rate at 0 here

  /// A share of the range of u, 1/s^2.
  double margin(double share) const { return share * (u_max - u_min); }
};

/// Runs ahead over the queue's segments with a given u, step by step, and judges every step.
class RateWalk {
 public:
  RateWalk() = default;
  RateWalk(const PlanLimits& limits, const MotionQueue::View& blocks, const PlanPlace& place, double rate,
           double slope);

  const PlanPlace& place() const { return place_; }
  double rate() const { return rate_; }
  double slope() const { return slope_; }
  /// The plan rests here; what follows begins in a period of its own, at any rate up to 1.
  bool ended() const { return ended_; }
  /// Plan time behind the place where the walk began, s.
  double passed_s() const { return passed_s_; }

  RateBounds bounds() const { return judged_ ? here_ : judge(); }
  /// Goes on with constant u for `duration_s`, or less: to the end of the segment, or a step's greatest
  /// length. Returns the time gone; negative if a limit would break or nothing is known of what follows.
  double step(double u, double duration_s);
  /// Goes on for the whole of `duration_s`; records the steps. False as `step`, or when it has taken too
  /// many.
  bool run(double u, double duration_s, RateStep* steps, int& count);
  /// Goes on for `duration_s` with constant u without judging anything.
  void coast(double duration_s, double u);
  /// Goes on by this plan time, at the present rate and slope, without judging anything.
  void skip(double plan_time_s);
  void set_rate(double rate, double slope) {
    rate_ = rate;
    slope_ = slope;
    judged_ = false;
  }

 private:
  RateBounds judge() const;
  void leave_segment();
  bool goes_too_fast() const;

  const PlanLimits* limits_ = nullptr;
  MotionQueue::View blocks_;
  PlanPlace place_;
  const MotionBlock* block_ = nullptr;
  double rate_ = 0, slope_ = 0, passed_s_ = 0;
  bool ended_ = false;
  bool judged_ = false;  ///< here_ holds
  RateBounds here_{};
};

}  // namespace trn
