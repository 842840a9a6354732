#pragma once

#include <cstdint>

#include "core/realtime.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_follower.h"
#include "kernel/rate_plan.h"
#include "kernel/rate_plans.h"

namespace trn {

/// The rate of the planned motion in the tick. Every lead (rate_lead_periods), or more rarely while nothing
/// changes, it asks the rate planner for a plan that begins one lead later, and takes the answer to the last
/// question. With an answer come stops in store. A hold begins with the next of them, and better ones replace
/// it as they come. Where an answer is late, the plan in force goes on; where it does not come at all, the
/// last stop in store is followed. It searches nothing, and waits for nobody.
class PathRate {
 public:
  PathRate(RatePlans& plans, double period_s);

  /// The motion is at rest: one period from its start with this rate (at most 1), without a ramp; the path's
  /// own start is the ramp. It stands while nobody answers.
  double start(MotionQueue& queue, double rate) TRN_RT;
  /// The motion is at rest and does not begin: asks now and then, so that it is known whether answers come.
  void rest(MotionQueue& queue) TRN_RT;
  /// It stands, and the motion has been moved elsewhere on the path: what was asked is void.
  void stand_elsewhere() TRN_RT;
  /// One period from `place` with this wish; returns the plan time that passes in it, s.
  double step(MotionQueue& queue, const PlanPlace& place, const RateWish& wish) TRN_RT;

  double rate() const TRN_RT { return follower_.rate(); }
  const RateFollower& follower() const TRN_RT { return follower_; }
  /// Stands, and will stand.
  bool standing() const TRN_RT { return follower_.standing(); }
  /// The answer to the last question is due and has not come.
  bool late() const TRN_RT { return late_periods_ > 0; }
  /// How often an answer was late by four leads and more while the machine moved, or so that it slowed down
  /// or waited for it.
  std::uint32_t late_answers() const TRN_RT { return late_answers_; }
  /// Plan time that passed in the first part (0 to 1) of the last period, s.
  double plan_time_at(double part) const TRN_RT { return follower_.plan_time_at(part); }

 private:
  int stop_that_begins(int periods) const TRN_RT;
  bool waits_for_stop(bool holds) const TRN_RT;
  bool has_later_stop(int index) TRN_RT;
  bool begin_stop(int index) TRN_RT;
  void take_answer() TRN_RT;
  bool stands_by() const TRN_RT;
  void notice_late() TRN_RT;

  RatePlans& plans_;
  RateFollower follower_;
  int lead_periods_;
  int periods_left_ = 0;    ///< until the answer is due
  bool asked_ = false;      ///< and no answer taken yet
  bool stale_ = false;      ///< and its answer is no longer wanted
  bool steady_ = false;     ///< the rate is what was wished at the last question, and stays so
  int since_question_ = 0;  ///< periods
  bool has_stops_ = false;  ///< in store, and nothing else was begun since
  std::uint64_t asked_from_ = 0,
                stops_from_ = 0;  ///< blocks that the question and the stops in store begin with
  int since_answer_ = 0;          ///< periods since the last answer began that was taken
  int late_periods_ = 0;
  bool moved_ = false;    ///< when the answer became late
  bool noticed_ = false;  ///< that it is
  std::uint32_t late_answers_ = 0;
  double asked_rate_ = 1;
};

}  // namespace trn
