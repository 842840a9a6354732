#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "core/axes.h"
#include "core/realtime.h"
#include "kernel/motion_queue.h"

namespace trn {

/// Below these a time (s) and a rate count as none.
inline constexpr double kNoTime_s = 1e-12, kNoRate = 1e-9;

/// A time with constant second derivative u of the rate.
struct RateStep {
  double duration_s = 0, u = 0;
};

/// How fast plan time passes from now on: steps of constant u, verified against the joints' limits on the
/// segments ahead, and a constant rate behind them. That is at most 1 or leads to where the path itself
/// rests, so a plan is safe for ever, whether another one follows it or not.
struct RatePlan {
  static constexpr int kStepsMax = 240;
  std::array<RateStep, kStepsMax> steps;
  int count = 0;
  int arrival = 0;        ///< steps that lead to the target; 0: it does not go there
  double target = 1;      ///< the rate it was made for
  double end_rate = 1;    ///< constant from there on
  double level_rate = 1;  ///< where r' first becomes 0
  bool stops = false;     ///< leads to rest
  bool at_place = false;  ///< at the place that was asked for

  /// From the beginning of a step on, s.
  double time_s(int from) const TRN_RT;
  /// Becomes the other, whose steps behind `count` nobody needs.
  void copy_from(const RatePlan& other) TRN_RT;
};

/// Where a motion stands in its rate plan: rate r, slope r' (1/s), and how much of which step is spent.
struct RateState {
  double rate = 1, slope = 0;
  int next = 0;  ///< step of the plan
  double spent_s = 0;

  /// Stands, and will stand.
  bool standing() const TRN_RT { return rate == 0 && slope == 0; }
  bool plan_ended(const RatePlan& plan) const TRN_RT { return next == plan.count; }
  /// Goes on for a time; returns the plan time that passes in it, s.
  double follow(const RatePlan& plan, double time_s) TRN_RT;
};

/// A place in the plan: `time_s` after the beginning of a segment of the block with this number.
struct PlanPlace {
  std::uint64_t block = 0;
  int segment = 0;
  double time_s = 0;
};

/// What the rate shall come to.
struct RateWish {
  static constexpr double kNoStop = 1e9;
  double rate = 1;  ///< 0 to 2
  double stop_in_s =
      kNoStop;  ///< plan time to the place where it shall come to rest; passes it if that is too near
};

/// How the motion goes now, and what a new plan is for. That begins one lead later.
struct RateRequest {
  PlanPlace place;
  RateState state;
  const RatePlan* plan = nullptr;  ///< in force
  RateWish wish;
  MotionQueue::View blocks;
};

/// Stops in store: where they begin, in leads behind the question that they came with. So a hold while
/// answers are late begins at the latest when they have been late for twice as long.
inline constexpr std::array kStopLeads = {2, 3, 4, 8, 16, 32, 64};
inline constexpr int kStopsInStore = static_cast<int>(kStopLeads.size());

/// Periods from the question for a rate plan to its begin: 2 ms.
int rate_lead_periods(double period_s) TRN_RT;

/// Plan time that a stop from rate 1 may take, s.
double plan_stop_s(const Joints& joints);
/// Farther away a stop need not be known yet, s of plan time. `stop_s`: as above.
inline double stop_horizon_s(double stop_s, double rate) TRN_RT { return 2 * stop_s * std::max(rate, 1.0); }

}  // namespace trn
