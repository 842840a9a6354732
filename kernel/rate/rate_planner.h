#pragma once

#include <algorithm>
#include <array>

#include "core/axes.h"
#include "kernel/motion_queue.h"
#include "kernel/rate/rate_walk.h"
#include "kernel/rate/stop_search.h"
#include "kernel/rate_plan.h"

namespace trn {

/// Makes the rate plans of a planned motion, beside the tick: override, hold and path-true stop.
///
/// The rate r = d(plan time)/dt goes from 0 (stand) over 1 (as planned) to 2; its second derivative u is
/// constant in a step. A joint that the plan moves by v, a, j moves by r v, r^2 a + r' v and r^3 j + 3 r r' a
/// + u v, so with the plan's own v, a, j of the segments ahead (JointMotion) every limit is a bound on r, r'
/// and u:
///   |r v| <= V,   |r^2 a + r' v| <= A,   |r^3 j + 3 r r' a + u v| <= J.
///
/// A constant rate of at most 1 is safe for ever, because the plan itself keeps the limits. So there is
/// always a rate plan in force: steps of constant u, verified against the three bounds on the segments ahead,
/// that end at a constant rate of at most 1; towards a target of 0 they end at rest if such a plan is known;
/// on the way down to another target they end at that, where r' cannot come back to 0 sooner. Each time a
/// plan is asked for, the greatest u towards the target for a period is tried, with a new plan behind it. The
/// first trial that verifies replaces the plan in force; where none does, the plan in force stays. When its
/// end just reaches the target, a constant u leads exactly there, or two steps do. A plan to a rate above 1
/// stays there for a few leads before it comes back to 1, so that the next one need not climb again.
///
/// Towards 0 the quicker is taken of the stop that StopSearch finds from here and the one behind a trial; and
/// once there is a stop, only one that ends sooner replaces it.
///
/// Bounded work: at most kTries trials, each of at most RatePlan::kStepsMax steps over the segments;
/// kBudget steps of searches for a slowdown, and kReturnsBudget where trials have to come down to rate 1.
/// With a stop to come to, kAims + 3 searches more, of kStepsMax steps.
class RatePlanner {
 public:
  RatePlanner(const Joints& joints, double period_s);

  /// A plan that is better for the wish than the one in force, from one lead behind the request on; null if
  /// there is none. It is kept until the next call.
  const RatePlan* plan(const RateRequest& request);
  /// A stop in store, of kStopLeads, behind that request and its answer; null if none is found.
  const RatePlan* stop(int index);

 private:
  static constexpr int kTries = 24;
  /// Steps of all searches for a slowdown, of one for a lower override, and of one for a stop in store.
  static constexpr int kBudget = 800, kOverrideBudget = 120, kStopBudget = 160;
  /// Of one search for the way back from a rate above 1, and of all of them.
  static constexpr int kReturnBudget = 150, kReturnsBudget = 900;
  static constexpr int kAims = 8;  ///< walks to come to a stop at a given place

  enum class Verdict : unsigned char { kSafe, kBeyondTarget, kBreaks };

  void begin_trials();
  void seek_stop(int index);
  bool find_stop_in_store(double ahead_s);
  bool find_late_stop(double ahead_s);
  const RatePlan* choose();
  const RatePlan* plan_stop_at(double stop_in_s);
  double time_to_stop(const RatePlan& chosen, const RateState& state, std::array<double, 2> travel,
                      double stop_in_s);
  double stop_after(const RatePlan& plan, RateState state, double duration_s, double passed_s = 0);
  double find_slowdown(const RateWalk& walk, double to, double release_share, int& budget);
  double find_stop(const RateWalk& walk);
  bool comes_down(const RateWalk& walk, double to, double release_share);
  double mean_u() const;
  double fastest(const RateWalk& walk, double direction) const;
  Verdict try_change(RateWalk walk, double direction, double u);
  bool try_changes(const RateWalk& walk, double direction, bool arrival);
  bool try_arrival(RateWalk walk);
  bool try_two_steps(const RateWalk& walk, double direction);
  bool arrives(RateWalk& walk);
  bool stays_level(const RateWalk& walk);
  bool try_stop(const RateWalk& walk);
  bool has_stop() const;
  bool level_out(RateWalk& walk);
  bool return_to_one(const RateWalk& walk);
  bool comes_back(const RateWalk& walk);

  PlanLimits limits_;
  StopSearch stop_search_;
  double lead_s_, stop_s_;

  // Of the request.
  MotionQueue::View blocks_;
  PlanPlace place_;
  RateState state_;
  const RatePlan* in_force_ = nullptr;
  double target_ = 1;

  RatePlan trial_, soonest_, best_, chosen_;
  RatePlan followed_;     ///< from one lead behind the request on: the answer, or the plan in force
  RateState begin_;       ///< there
  bool changes_ = false;  ///< it is an answer
  std::array<RatePlan, kStopsInStore> store_;
  std::array<bool, kStopsInStore> has_stop_{};
  int stops_sought_ = kStopsInStore;  ///< of the store, for this request
  bool ends_ = true;                  ///< the path rests before
  int budget_left_ = 0;               ///< steps of searches for this request
  int returns_left_ = 0;              ///< the same, for the way back to rate 1
};

}  // namespace trn
