#pragma once

#include <array>

#include "core/axes.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"
#include "kernel/plan_walk.h"
#include "kernel/way_down.h"

namespace trn {

/// Override, hold and path-true stop of a planned motion: a rate r = d(plan time)/dt from 0 (stand) over 1
/// (as planned) to 2, whose second derivative u is constant in a period. A joint that the plan moves by v, a,
/// j moves by r v, r^2 a + r' v and r^3 j + 3 r r' a + u v, so with the plan's own v, a, j of the segments
/// ahead (JointMotion) every limit is a bound on r, r' and u:
///   |r v| <= V,   |r^2 a + r' v| <= A,   |r^3 j + 3 r r' a + u v| <= J.
///
/// Safe for ever is a constant rate of at most 1, because the plan itself keeps the limits. So the law always
/// owns a way back: a sequence of constant u, verified against the three bounds on the segments ahead, that
/// ends at a constant rate of at most 1; towards a target of 0, one that ends at rest if there is one; on the
/// way down to another target, at that where r' cannot come back to 0 sooner. Each period it tries the
/// fastest u towards the target for that period and a new way back behind it; what verifies is taken,
/// otherwise the old way back is followed until something does. When the way back just reaches the target, a
/// constant u leads exactly there.
///
/// Towards 0 the quickest stop that WayDown finds from here is taken, or that behind a push; and once there
/// is a stop, only one that is sooner.
///
/// Bounded work: at most kTries attempts a period, each at most PlanWalk::kStepsMax steps over the segments;
/// and kWorkMost steps of searches for the way down, and kWorkOfAnOverride where a try has to come down to
/// rate 1. With a stop to come to, kAims + 3 searches more, of kStepsMax steps.
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
  /// Steps of the searches of a period, and of one for the way to an override.
  static constexpr int kWorkMost = 800, kWorkOfAnOverride = 120;
  static constexpr int kDoneMax = 2 * PlanWalk::kStepsMax;
  static constexpr int kAims = 8;        ///< walks to come to a stop at a given place
  static constexpr double kHorizon = 2;  ///< times the plan time of a stop

  enum class Verdict : unsigned char { kSafe, kBeyondTarget, kBreaks };

  /// What `follow` changes.
  struct Moment {
    double rate, slope, spent_s, done_rate, done_slope;
    int next, way_count, way_landing, done_count;
  };

  void choose(const MotionQueue& queue, const PlanPlace& place) TRN_RT;
  double step_towards(const MotionQueue& queue, const PlanPlace& place, double stop_in_s) TRN_RT;
  double time_to_stop(const MotionQueue& queue, const PlanPlace& place, std::array<double, 2> travel,
                      double stop_in_s) TRN_RT;
  double find_way_down(const PlanWalk& walk, double to, double early, int& work) TRN_RT;
  double find_stop(const PlanWalk& walk) TRN_RT;
  bool comes_down(const PlanWalk& walk, double to, double early) TRN_RT;
  double stop_after(const MotionQueue& queue, const PlanPlace& place, double duration_s) TRN_RT;
  Moment moment() const TRN_RT;
  void return_to(const Moment& moment) TRN_RT;
  double mean_u() const TRN_RT;
  double fastest(const PlanWalk& walk, double direction) const TRN_RT;
  Verdict try_push(PlanWalk walk, double direction, double u) TRN_RT;
  bool try_landing(PlanWalk walk) TRN_RT;
  bool try_stop(const PlanWalk& walk) TRN_RT;
  bool has_stop() const TRN_RT;
  bool settle(PlanWalk& walk) TRN_RT;
  bool return_to_one(const PlanWalk& walk) TRN_RT;
  void adopt() TRN_RT;
  void begin_period() TRN_RT;
  double follow(double left_s) TRN_RT;
  double pass(double u, double duration_s) TRN_RT;

  PlanLimits limits_;
  WayDown way_down_;
  double period_s_, stop_s_ = 0;
  double rate_ = 1, slope_ = 0, target_ = 1;
  Way way_, trial_;
  int work_left_ = 0;                    ///< steps of searches in this period
  bool stopping_ = false;                ///< way_ leads to a stop at a given place
  int next_ = 0;                         ///< step of way_
  double spent_s_ = 0;                   ///< of that step
  double share_ = 1;                     ///< of the fastest push, that is tried first
  double way_target_ = 1;                ///< the target way_ was made for
  std::array<RateStep, kDoneMax> done_;  ///< the last period
  int done_count_ = 0;
  double done_rate_ = 1, done_slope_ = 0;
};

}  // namespace trn
