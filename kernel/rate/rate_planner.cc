#include "kernel/rate/rate_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kTrialMargin =
    0.0015;  // of the range of u within a period; beside a limit much of what is left
constexpr double kSlopeUse = 0.9995;
constexpr double kShrink = 0.6;             // of a trial that broke a limit, for the next one
constexpr double kReleaseShare = 0.6;       // of the greatest u: when braking ends
constexpr double kLateReleaseShare = 0.85;  // the same, where that finds no stop
constexpr double kGentleArrival = 0.3;      // of the greatest u: below, trying on is faster
constexpr double kClimbFrom = 0.98;         // from this rate a trial towards more than 1 must last so
constexpr double kClimbS = 0.008;           // long, or the rate would tremble where there is no room
constexpr double kFarS = 0.02;              // before the last time to stop: look again with the next request
constexpr double kLevelLeads = 3;           // at a rate above 1, before the plan comes back from it
constexpr std::array kArrivalLeads = {1, 2, 4};  // each of the two steps to the target may last
constexpr int kLooksAhead = 2;
constexpr int kStopsInChange = 2;       // in store while plans follow each other
constexpr int kNearStops = 3;           // begin soon
constexpr double kLateStopShare = 0.1;  // of stop_s: steps in which a stop is looked for farther ahead
constexpr int kLateStops = 15;
constexpr double kApproach = 0.5;  // of stop_s: the time in which the distance to a stop becomes 1/e
constexpr double kSlowest = 0.02;  // of the rate, towards a stop
constexpr double kAimS = 1e-8;     // of plan time, before the place of a stop

}  // namespace

RatePlanner::RatePlanner(const Joints& joints, double period_s)
    : limits_(joints, period_s),
      stop_search_(limits_.step_s_max),
      lead_s_(rate_lead_periods(period_s) * period_s),
      stop_s_(plan_stop_s(joints)) {
  TRN_CHECK(period_s > 0);
  TRN_CHECK(std::isfinite(stop_s_) && stop_s_ > 0);
}

const RatePlan* RatePlanner::plan(const RateRequest& request) {
  blocks_ = request.blocks;
  target_ = request.wish.rate;
  state_ = request.state;
  in_force_ = request.plan;
  TRN_CHECK(target_ >= 0 && target_ <= 2);
  TRN_CHECK(request.wish.stop_in_s >= 0);
  TRN_CHECK(state_.rate >= -kNoRate && std::isfinite(state_.rate));
  const double gone_s = state_.follow(*in_force_, lead_s_);
  RateWalk walk(limits_, blocks_, request.place, state_.rate, state_.slope);
  walk.skip(gone_s);
  ends_ = walk.ended();
  stops_sought_ = 0;
  changes_ = false;
  if (ends_) return nullptr;
  place_ = walk.place();
  begin_trials();
  begin_ = state_;
  followed_.copy_from(*in_force_);
  const double stop_in_s = std::max(0.0, request.wish.stop_in_s - gone_s);
  const RatePlan* found =
      stop_in_s <= stop_horizon_s(stop_s_, state_.rate) ? plan_stop_at(stop_in_s) : choose();
  changes_ = found != nullptr;
  if (!found) return nullptr;
  followed_.copy_from(*found);
  begin_.next = 0;
  begin_.spent_s = 0;
  return &followed_;
}

// As if nothing had been tried before: what comes out depends on the request alone, and a replay, which does
// not make the plans that nobody took, gives the same.
void RatePlanner::begin_trials() {
  budget_left_ = kBudget;
  returns_left_ = kReturnsBudget;
  trial_.count = trial_.arrival = 0;
  trial_.target = trial_.end_rate = trial_.level_rate = 1;
  trial_.stops = trial_.at_place = false;
}

const RatePlan* RatePlanner::stop(int index) {
  TRN_CHECK(index >= 0 && index < kStopsInStore);
  while (stops_sought_ <= index) seek_stop(stops_sought_++);
  const auto k = static_cast<std::size_t>(index);
  return has_stop_[k] ? &store_[k] : nullptr;
}

// The near ones take each other's place, and so do the two farthest: where one is found, the next are not
// looked for. While plans follow each other the far ones would not be used either; but one stop there must
// be, so the last may go on for a while before it brakes.
void RatePlanner::seek_stop(int index) {
  const auto k = static_cast<std::size_t>(index);
  const auto found = std::count(has_stop_.begin(), has_stop_.begin() + index, true);
  has_stop_[k] = false;
  const bool near = index < kNearStops, last = index + 1 == kStopsInStore;
  if (ends_ || (near && found > 0) || (last && has_stop_[k - 1]) || (changes_ && found >= kStopsInChange))
    return;
  const double ahead_s = (kStopLeads[k] - 1) * lead_s_;
  has_stop_[k] = find_stop_in_store(ahead_s) || (last && find_late_stop(ahead_s));
  if (has_stop_[k]) store_[k].copy_from(trial_);
}

// As far ahead as the path is known for sure.
bool RatePlanner::find_stop_in_store(double ahead_s) {
  if (ahead_s > 2 * stop_s_) return false;
  RateState state = begin_;
  const double passed_s = state.follow(followed_, ahead_s);
  RateWalk walk(limits_, blocks_, place_, state.rate, state.slope);
  walk.skip(passed_s);
  if (walk.ended() || state.standing()) return false;
  begin_trials();
  budget_left_ = kStopBudget;
  trial_.target = 0;
  for (const double release_share : {kReleaseShare, kLateReleaseShare}) {
    trial_.count = trial_.arrival = 0;
    if (comes_down(walk, 0, release_share)) return true;
  }
  return false;
}

// Where joints with their greatest jerk leave u no choice, as long as a segment lasts, no stop begins: it
// goes on until one does.
bool RatePlanner::find_late_stop(double ahead_s) {
  RateState state = begin_;
  const double passed_s = state.follow(followed_, ahead_s);
  if (state.standing()) return false;
  begin_trials();
  for (int i = 1; i <= kLateStops; ++i)
    if (stop_after(followed_, state, i * kLateStopShare * stop_s_, passed_s) >= 0)
      return trial_.end_rate < state.rate;  // else the path ends there
  return false;
}

// Slows down as the stop comes nearer. Goes on as long as a stop behind the period comes in time; then the
// last one that does is followed. Where none is found from behind the period, one from here is taken if it
// loses little.
const RatePlan* RatePlanner::plan_stop_at(double stop_in_s) {
  if (in_force_->at_place && !state_.plan_ended(*in_force_)) return nullptr;
  target_ = std::min(target_, std::max(kSlowest, stop_in_s / (kApproach * stop_s_)));
  const double now = stop_after(*in_force_, state_, 0);
  RateState chosen_state = state_;
  const RatePlan* in_force = in_force_;
  const RatePlan* better = choose();
  if (better) {
    chosen_ = *better;
    chosen_state.next = 0;
    chosen_state.spent_s = 0;
  }
  const RatePlan& chosen = better ? chosen_ : *in_force;
  const double whole = stop_after(chosen, chosen_state, lead_s_);
  const bool in_time = now >= 0 && now <= stop_in_s;
  const bool loses_little = stop_in_s - now <= kFarS * state_.rate;
  if (!in_time || (whole < 0 && !loses_little) || (whole >= 0 && whole <= stop_in_s))
    return better ? &chosen_ : nullptr;
  const double longest = whole < 0 ? 0 : time_to_stop(chosen, chosen_state, {now, whole}, stop_in_s);
  TRN_CHECK(longest >= 0 && longest <= lead_s_);
  stop_after(chosen, chosen_state, longest);
  trial_.at_place = true;
  return &trial_;
}

// The longest part of the period that may go on as chosen, so that a stop behind it comes in time; `travel`:
// plan time to rest with none and with the whole of it.
double RatePlanner::time_to_stop(const RatePlan& chosen, const RateState& state, std::array<double, 2> travel,
                                 double stop_in_s) {
  double longest = 0, shortest = lead_s_, low = travel[0], high = travel[1];
  for (int i = 0; i < kAims && stop_in_s - low > kAimS; ++i) {
    // Chord and middle in turn: what a trial gains grows with its time, from rest with the third power.
    const double chord = (stop_in_s - low) / (high - low);
    const double part = i % 2 == 1 ? 0.5 : std::clamp(state.rate > 0 ? chord : std::cbrt(chord), 0.02, 0.98);
    const double duration_s = longest + part * (shortest - longest);
    const double at = stop_after(chosen, state, duration_s);
    const bool in_time = at >= 0 && at <= stop_in_s;
    (in_time ? longest : shortest) = duration_s;
    if (at >= 0) (in_time ? low : high) = at;
  }
  TRN_CHECK(longest <= shortest);
  return longest;
}

// Follows a plan for this long and then a stop, in trial_, from plan time `passed_s` behind place_ on. Plan
// time from there to rest, negative if no stop is found.
double RatePlanner::stop_after(const RatePlan& plan, RateState state, double duration_s, double passed_s) {
  TRN_CHECK(duration_s >= 0 && passed_s >= 0);
  trial_.count = trial_.arrival = 0;
  trial_.target = plan.target;
  double left_s = duration_s, spent_s = state.spent_s;
  for (int i = state.next; i < plan.count && left_s > 0; ++i) {
    const RateStep& step = plan.steps[static_cast<std::size_t>(i)];
    const double dt = std::min(left_s, step.duration_s - spent_s);
    trial_.steps[static_cast<std::size_t>(trial_.count++)] = {dt, step.u};
    if (i + 1 == plan.arrival && dt == step.duration_s - spent_s) trial_.arrival = trial_.count;
    left_s -= dt;
    spent_s = 0;
  }
  if (left_s > 0 && duration_s > 0) trial_.steps[static_cast<std::size_t>(trial_.count++)] = {left_s, 0};
  const double gone = duration_s > 0 ? state.follow(plan, duration_s) : 0;
  RateWalk walk(limits_, blocks_, place_, state.rate, state.slope);
  walk.skip(passed_s + gone);
  const int arrival = trial_.arrival;
  const double travel = find_stop(walk);
  trial_.arrival = arrival;
  return travel;
}

double RatePlanner::find_stop(const RateWalk& walk) {
  int budget = RatePlan::kStepsMax;
  return find_slowdown(walk, 0, kReleaseShare, budget);
}

// Behind a trial or none, with the budget that this period has left.
bool RatePlanner::comes_down(const RateWalk& walk, double to, double release_share) {
  const int most = to > 0 ? std::min(kOverrideBudget, budget_left_) : budget_left_;
  TRN_CHECK(most <= kBudget);
  int left = most;
  const bool found = find_slowdown(walk, to, release_share, left) >= 0;
  budget_left_ -= most - left;
  return found;
}

// A plan down to a rate, 0 to stop, in trial_ behind its steps; plan time from where the walk began,
// negative if none is found.
double RatePlanner::find_slowdown(const RateWalk& walk, double to, double release_share, int& budget) {
  TRN_CHECK(to >= 0 && to <= 1);
  trial_.arrival = 0;
  const double passed_s = stop_search_.find(walk, to, release_share, budget, trial_);
  if (to > 0 && passed_s >= 0 && trial_.end_rate == to) trial_.arrival = trial_.count;
  return passed_s;
}

// A better plan towards target_; null where the one in force stays.
const RatePlan* RatePlanner::choose() {
  const double rate = state_.rate, slope = state_.slope;
  const bool arrived = slope == 0 && std::abs(rate - target_) <= kNoRate && rate <= 1 + kNoRate;
  if (arrived) return nullptr;
  const RateWalk walk(limits_, blocks_, place_, rate, slope);
  if (walk.ended()) return nullptr;
  const RatePlan* found = nullptr;
  trial_.target = target_;
  if (slope == 0 && std::abs(rate - target_) <= kNoRate) return stays_level(walk) ? &trial_ : nullptr;
  if (target_ == 0) {  // a trial lasts the whole period, and may so be weaker than what a part of it allows
    trial_.count = trial_.arrival = 0;
    if (try_stop(walk)) {
      best_ = trial_;
      found = in_force_ = &best_;
      state_.next = 0;
      state_.spent_s = 0;
    }
  }
  const double distance = target_ - rate;
  const double direction = distance > 0 ? 1 : distance < 0 ? -1 : -std::copysign(slope != 0 ? 1 : 0, slope);
  const bool on_the_way = state_.next < in_force_->arrival && in_force_->target == target_;
  const bool arrival = (target_ == 0 && has_stop()) || on_the_way;
  return try_changes(walk, direction, arrival) ? &trial_ : found;
}

// A change of the rate for a lead, with the greatest u that verifies. `arrival`: the plan in force comes to
// the target.
bool RatePlanner::try_changes(const RateWalk& walk, double direction, bool arrival) {
  const double u_old = mean_u();
  const double level_old = state_.plan_ended(*in_force_) ? state_.rate : in_force_->level_rate;
  const double u_most = direction == 0 ? 0 : fastest(walk, direction);
  double scale = 1;
  for (int i = 0; i < kTries; ++i) {
    const double u = u_old + scale * (u_most - u_old);
    const Verdict verdict = try_change(walk, direction, u);
    if (verdict == Verdict::kSafe) return true;
    if (verdict == Verdict::kBreaks) {
      scale *= kShrink;
      continue;
    }
    if (arrival) return false;
    if (i == 0 && state_.slope * direction > 0 && try_arrival(walk)) return true;
    if (i == 0 && target_ > 0 && try_two_steps(walk, direction)) return true;
    const double share = (target_ - level_old) / (trial_.level_rate - level_old);
    scale *= std::clamp(0.98 * share, 0.0, 0.98);
  }
  return false;
}

// Mean u in the next lead, if the plan in force is followed.
double RatePlanner::mean_u() const {
  double slope = 0, left_s = lead_s_, spent_s = state_.spent_s;
  for (int i = state_.next; i < in_force_->count && left_s > 0; ++i) {
    const RateStep& step = in_force_->steps[static_cast<std::size_t>(i)];
    const double dt = std::min(left_s, step.duration_s - spent_s);
    slope += step.u * dt;
    left_s -= dt;
    spent_s = 0;
  }
  return slope / lead_s_;
}

// The greatest u in a direction that the bounds here and one lead ahead allow, where they are
// looked for first as if u were 0, then where that u leads.
double RatePlanner::fastest(const RateWalk& walk, double direction) const {
  const RateBounds here = walk.bounds();
  const double margin = here.margin(kTrialMargin);
  double u_max = here.u_max - margin, u_min = here.u_min + margin, u = 0;
  for (int i = 0; i < kLooksAhead; ++i) {
    RateWalk later = walk;
    later.coast(lead_s_, u);
    const RateBounds there = later.ended() ? here : later.bounds();
    u_max = std::min(u_max, there.u_max - margin);
    u_min = std::max(u_min, there.u_min + margin);
    const double to_max = (kSlopeUse * there.slope_max - state_.slope) / lead_s_;
    const double to_min = (kSlopeUse * there.slope_min - state_.slope) / lead_s_;
    u = direction > 0 ? std::max(u_min, std::min(u_max, to_max)) : std::min(u_max, std::max(u_min, to_min));
  }
  return u;
}

RatePlanner::Verdict RatePlanner::try_change(RateWalk walk, double direction, double u) {
  trial_.count = trial_.arrival = 0;
  trial_.stops = false;
  trial_.level_rate = state_.rate;
  const bool climbs = direction > 0 && target_ > 1 && state_.rate > kClimbFrom;
  const double time_s = climbs ? std::max(kClimbS, lead_s_) : lead_s_;
  const double end_rate = state_.rate + time_s * (state_.slope + time_s * u / 2);
  if (direction < 0 && end_rate < target_) {
    trial_.level_rate = 2 * end_rate - target_ - 1e-3;
    return Verdict::kBeyondTarget;
  }
  const double to_turn = state_.slope < 0 && u > 0 ? std::min(time_s, -state_.slope / u) : time_s;
  if (state_.rate + to_turn * (state_.slope + to_turn * u / 2) < 0)
    return Verdict::kBreaks;  // never backwards
  if (!walk.run(u, time_s, trial_.steps.data(), trial_.count)) return Verdict::kBreaks;
  const int steps_tried = trial_.count;
  if (target_ == 0) {
    if (try_stop(walk)) return Verdict::kSafe;
    if (has_stop()) return Verdict::kBreaks;
    trial_.count = steps_tried;
    trial_.stops = false;
  }
  RateWalk levelling = walk;
  const bool safe = level_out(levelling);
  if (direction * (trial_.level_rate - target_) > 0) return Verdict::kBeyondTarget;
  if (safe) return Verdict::kSafe;
  // Where r' cannot come back to 0 soon, it may farther down.
  const bool down = direction < 0 && target_ > 0 && target_ <= 1 && walk.slope() < 0;
  if (!down) return Verdict::kBreaks;
  trial_.count = steps_tried;
  return comes_down(walk, target_, kReleaseShare) ? Verdict::kSafe : Verdict::kBreaks;
}

bool RatePlanner::has_stop() const { return in_force_->stops && !state_.plan_ended(*in_force_); }

// A stop behind what is in trial_, sooner than the one that there is: the soonest of the shares tried.
bool RatePlanner::try_stop(const RateWalk& walk) {
  double most_s =
      has_stop() ? in_force_->time_s(state_.next) - state_.spent_s : std::numeric_limits<double>::infinity();
  const int steps_tried = trial_.count;
  bool found = false;
  for (const double release_share : {kReleaseShare, kLateReleaseShare}) {
    trial_.count = steps_tried;
    trial_.arrival = 0;
    if (!comes_down(walk, 0, release_share) || trial_.time_s(0) >= most_s) continue;
    found = true;
    most_s = trial_.time_s(0);
    soonest_.copy_from(trial_);
  }
  if (found) trial_.copy_from(soonest_);
  return found;
}

bool RatePlanner::try_arrival(RateWalk walk) {
  const double distance = target_ - state_.rate, u = -state_.slope * state_.slope / (2 * distance);
  const RateBounds bounds = walk.bounds();
  const double u_most = u > 0 ? bounds.u_max : -bounds.u_min;
  if (std::abs(u) > u_most || std::abs(u) < kGentleArrival * u_most) return false;
  const double level_before = trial_.level_rate;
  trial_.count = 0;
  if (!walk.run(u, 2 * distance / state_.slope, trial_.steps.data(), trial_.count)) {
    trial_.level_rate = level_before;
    return false;
  }
  return arrives(walk);
}

// Where a constant u does not lead to the target: two steps of one length T. With the distance d to the
// target and the slope w, the first has u = (d - 3 w T / 2) / T^2 and the second -w / T - u, which ends with
// r' = 0.
bool RatePlanner::try_two_steps(const RateWalk& walk, double direction) {
  const double level_before = trial_.level_rate, distance = target_ - state_.rate, w = state_.slope;
  for (const int leads : kArrivalLeads) {
    const double T = leads * lead_s_, u = (distance - 1.5 * w * T) / (T * T);
    if ((w + u * T) * direction < 0) break;  // it would pass the target and come back
    RateWalk way = walk;
    trial_.count = 0;
    if (!way.run(u, T, trial_.steps.data(), trial_.count) ||
        !way.run(-w / T - u, T, trial_.steps.data(), trial_.count))
      continue;
    if (arrives(way)) return true;
  }
  trial_.level_rate = level_before;
  return false;
}

// Behind the steps of trial_, which lead to the target.
bool RatePlanner::arrives(RateWalk& walk) {
  trial_.arrival = trial_.count;
  trial_.level_rate = trial_.end_rate = target_;
  walk.set_rate(target_, 0);
  return walk.ended() || target_ <= 1 + kNoRate || return_to_one(walk);
}

// On at a rate above 1, to which the motion has come.
bool RatePlanner::stays_level(const RateWalk& walk) {
  trial_.count = trial_.arrival = 0;
  trial_.stops = false;
  trial_.level_rate = trial_.end_rate = target_;
  return return_to_one(walk);
}

// The end of a trial's plan: first r' to 0, then, above rate 1, down to it.
bool RatePlanner::level_out(RateWalk& walk) {
  for (int i = 0; i <= RatePlan::kStepsMax; ++i) {
    const double r = walk.rate(), w = walk.slope();
    trial_.end_rate = std::min(r, 1.0);
    if (w == 0 || walk.ended()) {
      trial_.level_rate = r;
      return walk.ended() || r <= 1 + kNoRate || return_to_one(walk);
    }
    if (trial_.count == RatePlan::kStepsMax) return false;
    const RateBounds bounds = walk.bounds();
    if (!bounds.legal) return false;
    const double margin = bounds.margin(StopSearch::kMargin);
    const double u = w < 0 ? bounds.u_max - margin : bounds.u_min + margin;
    const double to_turn = u * w < 0 ? -w / u : std::numeric_limits<double>::infinity();
    if (u > 0 && r - w * w / (2 * u) < 0) {
      trial_.level_rate = std::min(trial_.level_rate, r - w * w / (2 * u));
      return false;
    }
    const double gone = walk.step(u, to_turn);
    if (gone < 0) return false;
    trial_.steps[static_cast<std::size_t>(trial_.count++)] = {gone, u};
    if (gone >= to_turn - kNoTime_s) walk.set_rate(walk.rate(), 0);
  }
  return false;
}

// From a constant rate above 1 to one that is safe for ever; where there is room, not before the next answers
// can come, or each of them would have to climb again.
bool RatePlanner::return_to_one(const RateWalk& walk) {
  const int steps = trial_.count;
  RateWalk level = walk;
  if (level.run(0, kLevelLeads * lead_s_, trial_.steps.data(), trial_.count) &&
      (level.ended() || comes_back(level)))
    return true;
  trial_.count = steps;
  return comes_back(walk);
}

bool RatePlanner::comes_back(const RateWalk& walk) {
  const int most = std::min(kReturnBudget, returns_left_);
  int left = most;
  const double level_rate = trial_.level_rate;
  const bool down = stop_search_.find(walk, 1, kReleaseShare, left, trial_) >= 0;
  returns_left_ -= most - std::max(left, 0);
  trial_.level_rate = level_rate;
  return down;
}

}  // namespace trn
