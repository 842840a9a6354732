#pragma once

#include <array>

#include "core/axes.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_walk.h"
#include "kernel/stop_search.h"

namespace trn {

/// Override, hold and path-true stop of a planned motion: a rate r = d(plan time)/dt from 0 (stand) over 1
/// (as planned) to 2, whose second derivative u is constant in a period. A joint that the plan moves by v, a,
/// j moves by r v, r^2 a + r' v and r^3 j + 3 r r' a + u v, so with the plan's own v, a, j of the segments
/// ahead (JointMotion) every limit is a bound on r, r' and u:
///   |r v| <= V,   |r^2 a + r' v| <= A,   |r^3 j + 3 r r' a + u v| <= J.
///
/// A constant rate of at most 1 is safe for ever, because the plan itself keeps the limits. So there is
/// always a rate plan in force: steps of constant u, verified against the three bounds on the segments ahead,
/// that end at a constant rate of at most 1; towards a target of 0 they end at rest if such a plan is known;
/// on the way down to another target they end at that, where r' cannot come back to 0 sooner. Each period
/// tries the greatest u towards the target for that period, with a new plan behind it. The first trial that
/// verifies replaces the plan in force; where none does, the plan in force is followed. When its end just
/// reaches the target, a constant u leads exactly there.
///
/// Towards 0 the quicker is taken of the stop that StopSearch finds from here and the one behind a trial; and
/// once there is a stop, only one that ends sooner replaces it.
///
/// Bounded work: at most kTries trials a period, each of at most RateWalk::kStepsMax steps over the segments;
/// kBudget steps of searches for a slowdown, and kOverrideBudget where a trial has to come down to rate 1.
/// With a stop to come to, kAims + 3 searches more, of kStepsMax steps.
class PathRate {
 public:
  PathRate(const Joints& joints, double period_s);

  /// The plan is at rest: begin with this rate (at most 1), without a ramp; the plan's own start is the ramp.
  void restart(double rate) TRN_RT;
  static constexpr double kNoStop = 1e9;

  /// One period from `place` with this target, 0 to 2; returns the plan time that passes in it, s. With
  /// `stop_in_s` the motion slows down and comes to rest after that plan time, or passes if that is too near.
  double step(const MotionQueue& queue, const PlanPlace& place, double target,
              double stop_in_s = kNoStop) TRN_RT;
  /// Farther away a stop need not be known yet, s of plan time.
  double stop_horizon_s() const TRN_RT { return kHorizon * stop_s_ * std::max(rate_, 1.0); }

  double rate() const TRN_RT { return rate_; }
  /// Stands, and will stand.
  bool standing() const TRN_RT { return rate_ == 0 && slope_ == 0; }
  /// Plan time that a stop from rate 1 may take, s.
  double stop_s() const TRN_RT { return stop_s_; }
  /// Plan time that passed in the first part (0 to 1) of the last period, s.
  double plan_time_at(double part) const TRN_RT;

 private:
  static constexpr int kTries = 3;
  /// Steps of all searches of a period, and of one search for a lower override.
  static constexpr int kBudget = 800, kOverrideBudget = 120;
  static constexpr int kDoneMax = 2 * RateWalk::kStepsMax;
  static constexpr int kAims = 8;        ///< walks to come to a stop at a given place
  static constexpr double kHorizon = 2;  ///< times the plan time of a stop

  enum class Verdict : unsigned char { kSafe, kBeyondTarget, kBreaks };

  /// What `follow` changes.
  struct Moment {
    double rate, slope, spent_s, done_rate, done_slope;
    int next, plan_count, plan_arrival, done_count;
  };

  void choose(const MotionQueue& queue, const PlanPlace& place) TRN_RT;
  double step_towards(const MotionQueue& queue, const PlanPlace& place, double stop_in_s) TRN_RT;
  double time_to_stop(const MotionQueue& queue, const PlanPlace& place, std::array<double, 2> travel,
                      double stop_in_s) TRN_RT;
  double find_slowdown(const RateWalk& walk, double to, double release_share, int& budget) TRN_RT;
  double find_stop(const RateWalk& walk) TRN_RT;
  bool comes_down(const RateWalk& walk, double to, double release_share) TRN_RT;
  double stop_after(const MotionQueue& queue, const PlanPlace& place, double duration_s) TRN_RT;
  Moment moment() const TRN_RT;
  void return_to(const Moment& moment) TRN_RT;
  double mean_u() const TRN_RT;
  double fastest(const RateWalk& walk, double direction) const TRN_RT;
  Verdict try_change(RateWalk walk, double direction, double u) TRN_RT;
  bool try_arrival(RateWalk walk) TRN_RT;
  bool try_stop(const RateWalk& walk) TRN_RT;
  bool has_stop() const TRN_RT;
  bool level_out(RateWalk& walk) TRN_RT;
  bool return_to_one(const RateWalk& walk) TRN_RT;
  void adopt() TRN_RT;
  void begin_period() TRN_RT;
  double follow(double left_s) TRN_RT;
  double pass(double u, double duration_s) TRN_RT;

  PlanLimits limits_;
  StopSearch stop_search_;
  double period_s_, stop_s_ = 0;
  double rate_ = 1, slope_ = 0, target_ = 1;
  RatePlan plan_, trial_;
  int budget_left_ = 0;                  ///< steps of searches in this period
  bool stopping_ = false;                ///< plan_ leads to a stop at a given place
  int next_ = 0;                         ///< step of plan_
  double spent_s_ = 0;                   ///< of that step
  double trial_scale_ = 1;               ///< of the greatest change of u, that is tried first
  double plan_target_ = 1;               ///< the target plan_ was made for
  std::array<RateStep, kDoneMax> done_;  ///< the last period
  int done_count_ = 0;
  double done_rate_ = 1, done_slope_ = 0;
};

}  // namespace trn
