#include "kernel/path_rate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kTrialMargin =
    0.0015;  // of the range of u within a period; beside a limit much of what is left
constexpr double kSlopeUse = 0.9995;
constexpr double kShrink = 0.25;            // of a trial that broke a limit, for the next one
constexpr double kTrialScaleMin = 1e-3;     // of the greatest change of u
constexpr double kReleaseShare = 0.6;       // of the greatest u: when braking ends
constexpr double kLateReleaseShare = 0.85;  // the same, where that finds no stop
constexpr double kGentleArrival = 0.3;      // of the greatest u: below, trying on is faster
constexpr double kClimbFrom = 0.98;         // from this rate a trial towards more than 1 must last so
constexpr int kTrialPeriods = 8;            // many periods, or the rate would tremble where there is no room
constexpr double kStopReserve = 2;          // plan time of a stop over the time of a joint's shortest stop
constexpr double kNearS = 1e-12;
constexpr double kFarPeriods = 20;  // before the last one to stop: look again in the next period
constexpr double kRest = 1e-9;      // of the rate: no difference
constexpr int kLooksAhead = 2;
constexpr double kApproach = 0.5;  // of stop_s: the time in which the distance to a stop becomes 1/e
constexpr double kSlowest = 0.02;  // of the rate, towards a stop
constexpr double kAimS = 1e-8;     // of plan time, before the place of a stop

}  // namespace

PathRate::PathRate(const Joints& joints, double period_s)
    : limits_(joints, period_s), stop_search_(limits_.step_s_max), period_s_(period_s) {
  for (const Joint& joint : joints) {
    const JointLimit& limit = joint.limit;
    stop_s_ = std::max(stop_s_, limit.velocity / limit.acceleration + limit.acceleration / limit.jerk);
  }
  stop_s_ *= kStopReserve;
  TRN_CHECK(period_s > 0);
  TRN_CHECK(std::isfinite(stop_s_) && stop_s_ > 0);
}

void PathRate::restart(double rate) TRN_RT {
  TRN_CHECK(rate >= 0);
  rate_ = std::min(rate, 1.0);
  slope_ = 0;
  plan_.count = plan_.arrival = next_ = 0;
  spent_s_ = 0;
  stopping_ = false;
}

double PathRate::step(const MotionQueue& queue, const PlanPlace& place, double target,
                      double stop_in_s) TRN_RT {
  target_ = target;
  TRN_CHECK(target >= 0 && target <= 2);
  TRN_CHECK(stop_in_s >= 0);
  TRN_CHECK(rate_ >= -kRest && std::isfinite(rate_));
  begin_period();
  budget_left_ = kBudget;
  if (stop_in_s <= stop_horizon_s()) return step_towards(queue, place, stop_in_s);
  stopping_ = false;
  choose(queue, place);
  return follow(period_s_);
}

// Slows down as the stop comes nearer. Goes on as long as a stop behind the period comes in
// time; then the last one that does is followed. Where none is found from behind the period, one from here is
// taken if it loses little.
double PathRate::step_towards(const MotionQueue& queue, const PlanPlace& place, double stop_in_s) TRN_RT {
  stopping_ = stopping_ && next_ < plan_.count;
  if (stopping_) return follow(period_s_);
  target_ = std::min(target_, std::max(kSlowest, stop_in_s / (kApproach * stop_s_)));
  const double now = stop_after(queue, place, 0);
  choose(queue, place);
  const double whole = stop_after(queue, place, period_s_);
  const bool in_time = now >= 0 && now <= stop_in_s;
  const bool loses_little = stop_in_s - now <= kFarPeriods * rate_ * period_s_;
  if (!in_time || (whole < 0 && !loses_little) || (whole >= 0 && whole <= stop_in_s))
    return follow(period_s_);
  const double longest = whole < 0 ? 0 : time_to_stop(queue, place, {now, whole}, stop_in_s);
  const double gone = longest > 0 ? follow(longest) : 0;
  TRN_CHECK(longest >= 0 && longest <= period_s_);
  RateWalk walk(limits_, queue, place, rate_, slope_);
  walk.skip(gone);
  find_stop(walk);
  adopt();
  stopping_ = true;
  return gone + follow(period_s_ - longest);
}

// The longest part of the period that may go on as chosen, so that a stop behind it comes in time; `travel`:
// plan time to rest with none and with the whole of it.
double PathRate::time_to_stop(const MotionQueue& queue, const PlanPlace& place, std::array<double, 2> travel,
                              double stop_in_s) TRN_RT {
  double longest = 0, shortest = period_s_, low = travel[0], high = travel[1];
  for (int i = 0; i < kAims && stop_in_s - low > kAimS; ++i) {
    // Chord and middle in turn: what a trial gains grows with its time, from rest with the third power.
    const double chord = (stop_in_s - low) / (high - low);
    const double part = i % 2 == 1 ? 0.5 : std::clamp(rate_ > 0 ? chord : std::cbrt(chord), 0.02, 0.98);
    const double duration_s = longest + part * (shortest - longest);
    const double at = stop_after(queue, place, duration_s);
    const bool in_time = at >= 0 && at <= stop_in_s;
    (in_time ? longest : shortest) = duration_s;
    if (at >= 0) (in_time ? low : high) = at;
  }
  TRN_CHECK(longest <= shortest);
  return longest;
}

// Plan time from here to rest, if the plan in force is followed for this long and then a stop; negative: none
// is found.
double PathRate::stop_after(const MotionQueue& queue, const PlanPlace& place, double duration_s) TRN_RT {
  TRN_CHECK(duration_s >= 0 && duration_s <= period_s_);
  const Moment before = moment();
  const double gone = duration_s > 0 ? follow(duration_s) : 0;
  RateWalk walk(limits_, queue, place, rate_, slope_);
  walk.skip(gone);
  const double travel = find_stop(walk);
  return_to(before);
  return travel;
}

double PathRate::find_stop(const RateWalk& walk) TRN_RT {
  int budget = RateWalk::kStepsMax;
  trial_.count = 0;
  return find_slowdown(walk, 0, kReleaseShare, budget);
}

// Behind a trial or none, with the budget that this period has left.
bool PathRate::comes_down(const RateWalk& walk, double to, double release_share) TRN_RT {
  const int most = to > 0 ? std::min(kOverrideBudget, budget_left_) : budget_left_;
  TRN_CHECK(most <= kBudget);
  int left = most;
  const bool found = find_slowdown(walk, to, release_share, left) >= 0;
  budget_left_ -= most - left;
  return found;
}

// A plan down to a rate, 0 to stop, in trial_ behind its steps; plan time from where the walk began,
// negative if none is found.
double PathRate::find_slowdown(const RateWalk& walk, double to, double release_share, int& budget) TRN_RT {
  TRN_CHECK(to >= 0 && to <= 1);
  trial_.arrival = 0;
  const double passed_s = stop_search_.find(walk, to, release_share, budget, trial_);
  if (to > 0 && passed_s >= 0 && trial_.end_rate == to) trial_.arrival = trial_.count;
  return passed_s;
}

PathRate::Moment PathRate::moment() const TRN_RT {
  return {rate_, slope_, spent_s_, done_rate_, done_slope_, next_, plan_.count, plan_.arrival, done_count_};
}

void PathRate::return_to(const Moment& m) TRN_RT {
  rate_ = m.rate;
  slope_ = m.slope;
  spent_s_ = m.spent_s;
  done_rate_ = m.done_rate;
  done_slope_ = m.done_slope;
  next_ = m.next;
  plan_.count = m.plan_count;
  plan_.arrival = m.plan_arrival;
  done_count_ = m.done_count;
}

void PathRate::choose(const MotionQueue& queue, const PlanPlace& place) TRN_RT {
  const bool arrived = slope_ == 0 && std::abs(rate_ - target_) <= kRest && rate_ <= 1 + kRest;
  if (arrived) return;
  const RateWalk walk(limits_, queue, place, rate_, slope_);
  if (walk.ended()) return;
  if (target_ == 0) {  // a trial lasts the whole period, and may so be weaker than what a part of it allows
    trial_.count = trial_.arrival = 0;
    if (try_stop(walk)) adopt();
  }
  const double distance = target_ - rate_;
  const double direction = distance > 0 ? 1 : distance < 0 ? -1 : -std::copysign(slope_ != 0 ? 1 : 0, slope_);
  const bool arrival = (target_ == 0 && has_stop()) || (next_ < plan_.arrival && plan_target_ == target_);
  const double u_old = mean_u();
  const double level_old = next_ < plan_.count ? plan_.level_rate : rate_;
  const double u_most = direction == 0 ? 0 : fastest(walk, direction);
  trial_scale_ = std::min(1.0, trial_scale_ / kShrink);
  double u = u_old + trial_scale_ * (u_most - u_old);
  for (int i = 0; i < kTries; ++i) {
    const Verdict verdict = try_change(walk, direction, u);
    if (verdict == Verdict::kSafe) return adopt();
    if (verdict == Verdict::kBreaks) {
      trial_scale_ = std::max(kTrialScaleMin, kShrink * trial_scale_);
      u = u_old + trial_scale_ * (u_most - u_old);
      continue;
    }
    if (arrival) return;
    if (i == 0 && slope_ * direction > 0 && try_arrival(walk)) return adopt();
    const double share = (target_ - level_old) / (trial_.level_rate - level_old);
    u = u_old + std::clamp(0.98 * share, 0.0, 0.98) * (u - u_old);
  }
}

// Mean u of the next period, if the plan in force is followed.
double PathRate::mean_u() const TRN_RT {
  double slope = 0, left_s = period_s_, spent_s = spent_s_;
  for (int i = next_; i < plan_.count && left_s > 0; ++i) {
    const RateStep& step = plan_.steps[static_cast<std::size_t>(i)];
    const double dt = std::min(left_s, step.duration_s - spent_s);
    slope += step.u * dt;
    left_s -= dt;
    spent_s = 0;
  }
  return slope / period_s_;
}

// The greatest u in a direction that the bounds here and one period ahead allow, where they are looked for
// first as if u were 0, then where that u leads.
double PathRate::fastest(const RateWalk& walk, double direction) const TRN_RT {
  const RateBounds here = walk.bounds();
  const double margin = here.margin(kTrialMargin);
  double u_max = here.u_max - margin, u_min = here.u_min + margin, u = 0;
  for (int i = 0; i < kLooksAhead; ++i) {
    RateWalk later = walk;
    later.coast(period_s_, u);
    const RateBounds there = later.ended() ? here : later.bounds();
    u_max = std::min(u_max, there.u_max - margin);
    u_min = std::max(u_min, there.u_min + margin);
    const double to_max = (kSlopeUse * there.slope_max - slope_) / period_s_;
    const double to_min = (kSlopeUse * there.slope_min - slope_) / period_s_;
    u = direction > 0 ? std::max(u_min, std::min(u_max, to_max)) : std::min(u_max, std::max(u_min, to_min));
  }
  return u;
}

PathRate::Verdict PathRate::try_change(RateWalk walk, double direction, double u) TRN_RT {
  trial_.count = trial_.arrival = 0;
  trial_.stops = false;
  trial_.level_rate = rate_;
  const bool climbs = direction > 0 && target_ > 1 && rate_ > kClimbFrom;
  const double time_s = climbs ? kTrialPeriods * period_s_ : period_s_;
  const double end_rate = rate_ + time_s * (slope_ + time_s * u / 2);
  if (direction < 0 && end_rate < target_) {
    trial_.level_rate = 2 * end_rate - target_ - 1e-3;
    return Verdict::kBeyondTarget;
  }
  const double to_turn = slope_ < 0 && u > 0 ? std::min(time_s, -slope_ / u) : time_s;
  if (rate_ + to_turn * (slope_ + to_turn * u / 2) < 0) return Verdict::kBreaks;  // never backwards
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

bool PathRate::has_stop() const TRN_RT { return plan_.stops && next_ < plan_.count; }

// A stop behind what is in trial_, sooner than the one that there is.
bool PathRate::try_stop(const RateWalk& walk) TRN_RT {
  const double most_s = has_stop() ? plan_.time_s(next_) - spent_s_ : std::numeric_limits<double>::infinity();
  const int steps_tried = trial_.count;
  for (const double release_share : {kReleaseShare, kLateReleaseShare}) {
    trial_.count = steps_tried;
    if (comes_down(walk, 0, release_share) && trial_.time_s(0) < most_s) return true;
  }
  return false;
}

bool PathRate::try_arrival(RateWalk walk) TRN_RT {
  const double distance = target_ - rate_, u = -slope_ * slope_ / (2 * distance);
  const RateBounds bounds = walk.bounds();
  const double u_most = u > 0 ? bounds.u_max : -bounds.u_min;
  if (std::abs(u) > u_most || std::abs(u) < kGentleArrival * u_most) return false;
  const double level_before = trial_.level_rate;
  trial_.count = 0;
  if (!walk.run(u, 2 * distance / slope_, trial_.steps.data(), trial_.count)) {
    trial_.level_rate = level_before;
    return false;
  }
  trial_.arrival = trial_.count;
  trial_.level_rate = trial_.end_rate = target_;
  walk.set_rate(target_, 0);
  return walk.ended() || target_ <= 1 + kRest || return_to_one(walk);
}

// The end of a trial's plan: first r' to 0, then, above rate 1, down to it.
bool PathRate::level_out(RateWalk& walk) TRN_RT {
  for (int i = 0; i <= RateWalk::kStepsMax; ++i) {
    const double r = walk.rate(), w = walk.slope();
    trial_.end_rate = std::min(r, 1.0);
    if (w == 0 || walk.ended()) {
      trial_.level_rate = r;
      return walk.ended() || r <= 1 + kRest || return_to_one(walk);
    }
    if (trial_.count == RateWalk::kStepsMax) return false;
    const RateBounds bounds = walk.bounds();
    if (!bounds.legal) return false;
    const double margin = bounds.margin(RatePlan::kMargin);
    const double u = w < 0 ? bounds.u_max - margin : bounds.u_min + margin;
    const double to_turn = u * w < 0 ? -w / u : std::numeric_limits<double>::infinity();
    if (u > 0 && r - w * w / (2 * u) < 0) {
      trial_.level_rate = std::min(trial_.level_rate, r - w * w / (2 * u));
      return false;
    }
    const double gone = walk.step(u, to_turn);
    if (gone < 0) return false;
    trial_.steps[static_cast<std::size_t>(trial_.count++)] = {gone, u};
    if (gone >= to_turn - kNearS) walk.set_rate(walk.rate(), 0);
  }
  return false;
}

// From a constant rate above 1 to one that is safe for ever.
bool PathRate::return_to_one(const RateWalk& walk) TRN_RT {
  int budget = kOverrideBudget;
  const double level_rate = trial_.level_rate;
  const bool down = stop_search_.find(walk, 1, kReleaseShare, budget, trial_) >= 0;
  trial_.level_rate = level_rate;
  return down;
}

void PathRate::adopt() TRN_RT {
  TRN_CHECK(trial_.count >= 0 && trial_.count <= RateWalk::kStepsMax);
  TRN_CHECK(trial_.arrival >= 0 && trial_.arrival <= trial_.count);
  TRN_CHECK(trial_.end_rate >= -kRest && trial_.end_rate <= 2);
  std::copy_n(trial_.steps.begin(), trial_.count, plan_.steps.begin());
  plan_.count = trial_.count;
  plan_.arrival = trial_.arrival;
  plan_.stops = trial_.stops;
  plan_.end_rate = trial_.end_rate;
  plan_.level_rate = trial_.level_rate;
  plan_target_ = target_;
  next_ = 0;
  spent_s_ = 0;
}

void PathRate::begin_period() TRN_RT {
  done_rate_ = rate_;
  done_slope_ = slope_;
  done_count_ = 0;
}

double PathRate::follow(double left_s) TRN_RT {
  TRN_CHECK(left_s >= 0);
  TRN_CHECK(next_ >= 0 && next_ <= plan_.count);
  double passed = 0;
  while (left_s > kNearS && next_ < plan_.count) {
    const RateStep& step = plan_.steps[static_cast<std::size_t>(next_)];
    const double dt = std::min(left_s, step.duration_s - spent_s_);
    passed += pass(step.u, dt);
    left_s -= dt;
    spent_s_ += dt;
    if (spent_s_ < step.duration_s - kNearS) continue;
    ++next_;
    spent_s_ = 0;
    if (next_ == plan_.arrival) {
      rate_ = plan_target_;
      slope_ = 0;
    }
  }
  if (next_ == plan_.count && plan_.count > 0) {
    TRN_CHECK(plan_.end_rate >= -kRest && plan_.end_rate <= 2);
    rate_ = plan_.end_rate;
    slope_ = 0;
    plan_.count = plan_.arrival = next_ = 0;
  }
  return left_s > kNearS ? passed + pass(0, left_s) : passed;
}

double PathRate::pass(double u, double duration_s) TRN_RT {
  TRN_CHECK(duration_s >= 0);
  TRN_CHECK(std::isfinite(u));
  const bool merge = done_count_ > 0 && done_[static_cast<std::size_t>(done_count_ - 1)].u == u;
  if (merge)
    done_[static_cast<std::size_t>(done_count_ - 1)].duration_s += duration_s;
  else if (done_count_ < kDoneMax)
    done_[static_cast<std::size_t>(done_count_++)] = {duration_s, u};
  const double passed = duration_s * (rate_ + duration_s * (slope_ / 2 + duration_s * u / 6));
  rate_ += duration_s * (slope_ + duration_s * u / 2);
  slope_ += duration_s * u;
  return passed;
}

double PathRate::plan_time_at(double part) const TRN_RT {
  double left_s = part * period_s_, r = done_rate_, w = done_slope_, passed = 0;
  for (int i = 0; i < done_count_ && left_s > 0; ++i) {
    const RateStep& step = done_[static_cast<std::size_t>(i)];
    const double dt = std::min(left_s, step.duration_s);
    passed += dt * (r + dt * (w / 2 + dt * step.u / 6));
    r += dt * (w + dt * step.u / 2);
    w += dt * step.u;
    left_s -= dt;
  }
  return passed;
}

}  // namespace trn
