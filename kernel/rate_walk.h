#pragma once

#include <array>

#include "core/axes.h"
#include "core/motion.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"

namespace trn {

/// A place in the plan: `time_s` after the beginning of a segment, `block` places behind the queue's front.
struct PlanPlace {
  std::uint64_t block = 0;
  int segment = 0;
  double time_s = 0;
};

/// The joints' limits over their jerk limits, as in JointMotion: A/J in s, V/J in s^2.
struct PlanLimits {
  explicit PlanLimits(const Joints& joints, double period_s);
  int count = 0;
  std::array<double, kMaxJoints> acceleration{}, velocity{};
  double u_max = 0;       ///< bound of |u| where nothing moves, 1/s^2
  double step_s_max = 0;  ///< of a walk's step, so that bounds at its ends hold in between
};

/// A time with constant second derivative u of the rate.
struct RateStep {
  double duration_s = 0, u = 0;
};

/// What the joints' limits leave to the rate at one place: bounds of u and of r' there.
struct RateBounds {
  double u_min, u_max, slope_min, slope_max;
  bool legal;      ///< false: too fast, or no u serves all joints
  double u_still;  ///< bound of |u| with the rate at 0 here

  /// A share of the range of u, 1/s^2.
  double margin(double share) const TRN_RT { return share * (u_max - u_min); }
};

/// Runs ahead over the queue's segments with a given u, step by step, and judges every step.
class RateWalk {
 public:
  static constexpr int kStepsMax = 240;

  RateWalk() = default;
  RateWalk(const PlanLimits& limits, const MotionQueue& queue, const PlanPlace& place, double rate,
           double slope) TRN_RT;

  double rate() const TRN_RT { return rate_; }
  double slope() const TRN_RT { return slope_; }
  /// The plan rests here; what follows begins in a period of its own, at any rate up to 1.
  bool ended() const TRN_RT { return ended_; }
  /// Plan time behind the place where the walk began, s.
  double passed_s() const TRN_RT { return passed_s_; }

  RateBounds bounds() const TRN_RT { return judged_ ? here_ : judge(); }
  /// Goes on with constant u for `duration_s`, or less: to the end of the segment, or a step's greatest
  /// length. Returns the time gone; negative if a limit would break or nothing is known of what follows.
  double step(double u, double duration_s) TRN_RT;
  /// Goes on for the whole of `duration_s`; records the steps. False as `step`, or when it has taken too
  /// many.
  bool run(double u, double duration_s, RateStep* steps, int& count) TRN_RT;
  /// Goes on for `duration_s` with constant u without judging anything.
  void coast(double duration_s, double u) TRN_RT;
  /// Goes on by this plan time, at the present rate and slope, without judging anything.
  void skip(double plan_time_s) TRN_RT;
  void set_rate(double rate, double slope) TRN_RT {
    rate_ = rate;
    slope_ = slope;
    judged_ = false;
  }

 private:
  RateBounds judge() const TRN_RT;
  void leave_segment() TRN_RT;
  bool goes_too_fast() const TRN_RT;

  const PlanLimits* limits_ = nullptr;
  const MotionQueue* queue_ = nullptr;
  PlanPlace place_;
  const MotionBlock* block_ = nullptr;
  double rate_ = 0, slope_ = 0, passed_s_ = 0;
  bool ended_ = false;
  bool judged_ = false;  ///< here_ holds
  RateBounds here_{};
};

}  // namespace trn
