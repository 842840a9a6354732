#include "kernel/rate/stop_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kHereMargin = 0.003;  // of the range of u, where a step that was tried again begins
constexpr double kRetrySlopeUse = 0.98;
constexpr int kRetries = 3;
constexpr double kNear =
    1e-3;  // of the squared slope at which the release begins: it is met in a few steps, not in 30
constexpr double kDeficitShare = 0.08;  // of what r' is too low by, recovered in one backtracking
constexpr double kShareGrowth = 4;      // the same, while the search does not get past a place
constexpr double kPastS = 0.001;        // of plan time: a place is passed
constexpr double kDeficitMin = 1e-6;
constexpr int kSlopes = 8;  // parts of r' in which that which a place bears is looked for
constexpr int kBacktracks = 48, kBacktracksAbove0 = 12;  // of a search for a stop, for a lower rate
constexpr double kLowRate = 0.1;                         // below, r' must come to 0 before the rate does

// How long u < 0 may last until a constant `release_u` brings rate and slope to 0 together:
// (w + u t)^2 = 2 release_u (r + w t + u t^2 / 2). So the end of a stop does not depend on where steps begin.
double time_to_final_release(double r, double w, double u, double release_u) {
  const double never = std::numeric_limits<double>::infinity();
  if (u >= 0 || release_u <= 0) return never;
  const double p = w / u, q = (w * w - 2 * release_u * r) / (u * (u - release_u)), root = p * p - q;
  if (root < 0) return never;
  const double t = -p + std::sqrt(root);
  return t > 0 ? t : never;
}

// The brake is released: r' comes back to 0.
double release(const RateWalk& walk, const RateBounds& bounds) {
  const double most = bounds.u_max - bounds.margin(StopSearch::kMargin);
  return walk.slope() < 0 ? most : std::min(0.0, most);
}

// The lowest r' above the present one that its place seems to bear at this rate. Its limits are convex
// in r' and u, and at a rate of at most 1 it bears 0: so it bears all slopes up to there, and each look
// halves them. Above rate 1 it may bear none of those that are looked at; then 0 is the answer.
double feasible_slope(RateWalk walk) {
  const double r = walk.rate(), w = walk.slope();
  int borne = 0;
  for (int step = kSlopes / 2; step > 0; step /= 2) {
    const double tried = w * (borne + step) / kSlopes;
    walk.set_rate(r, tried);
    const RateBounds bounds = walk.bounds();
    const bool comes_to_rest = r > kLowRate || tried * tried < 2 * r * bounds.u_max;
    if (bounds.legal && tried > bounds.slope_min && comes_to_rest) borne += step;
  }
  return w * borne / kSlopes;
}

}  // namespace

double StopSearch::find(const RateWalk& from, double to, double release_share, int& budget, RatePlan& plan) {
  const int behind = plan.count;
  TRN_CHECK(behind >= 0 && behind <= RatePlan::kStepsMax);
  TRN_CHECK(to >= 0 && to <= 1);
  TRN_CHECK(release_share > 0 && release_share < 1);
  to_ = to;
  release_share_ = release_share;
  at_ = behind;
  release_from_ = RatePlan::kStepsMax;
  release_until_s_ = 0;
  deficit_share_ = kDeficitShare;
  backtracks_left_ = to > 0 ? kBacktracksAbove0 : kBacktracks;
  checkpoints_[static_cast<std::size_t>(at_)] = from;
  plan.stops = to == 0;
  plan.level_rate = plan.end_rate = to;
  while (budget-- > 0) {
    const auto k = static_cast<std::size_t>(at_);
    TRN_CHECK(at_ >= behind);
    const RateWalk& here = checkpoints_[k];
    plan.count = at_;
    if (here.ended()) {
      plan.end_rate = std::min(here.rate(), 1.0);
      return here.passed_s();
    }
    if (here.slope() == 0 && here.rate() <= to + kNoRate)
      return here.rate() < to - kNoRate ? -1 : here.passed_s();  // not from below
    if (at_ == RatePlan::kStepsMax) return -1;
    const RateBounds bounds = here.bounds();
    const bool off = at_ >= release_from_ && here.passed_s() < release_until_s_;
    if (bounds.legal && advance(here, bounds, off, plan.steps[k], checkpoints_[k + 1])) {
      released_[k] = off || (here.slope() < 0 && plan.steps[k].u >= 0);
      ++at_;
    } else if (backtracks_left_-- == 0 || !backtrack(behind, plan)) {
      return -1;
    }
  }
  return -1;
}

// One step, at most to where r' has become 0 or `release_u` brings both rate and slope to 0. Where u breaks a
// bound at the end of the step, that bound is taken into account, within the bounds here.
bool StopSearch::advance(const RateWalk& here, const RateBounds& bounds, bool releasing, RateStep& step,
                         RateWalk& next) const {
  const double w = here.slope(), release_u = final_release(bounds), margin_here = bounds.margin(kHereMargin);
  double u = releasing ? release(here, bounds) : brake(here, bounds);
  for (int i = 0; i < kRetries; ++i) {
    const double to_turn = u * w < 0 ? -w / u : std::numeric_limits<double>::infinity();
    next = here;
    const double gone =
        next.step(u, std::min(to_turn, time_to_final_release(here.rate() - to_, w, u, release_u)));
    if (gone >= 0) {
      step = {gone, u};
      TRN_CHECK(std::isfinite(u));
      if (gone >= to_turn - kNoTime_s) next.set_rate(next.rate(), 0);
      return true;
    }
    const RateBounds end = next.bounds();
    const double margin = end.margin(StopSearch::kMargin);
    if (!end.legal) return false;
    const double to_slope = (kRetrySlopeUse * end.slope_min - w) / step_s_max_;
    u = std::clamp(u, std::min(end.u_max - margin, std::max(end.u_min + margin, to_slope)),
                   end.u_max - margin);
    if (u < bounds.u_min + margin_here || u > bounds.u_max - margin_here) return false;
  }
  return false;
}

// Back to the step from which releasing the brake sooner recovers 8 % of the slope deficit here. More would
// overshoot: what is gained there keeps growing up to here, and the stop becomes slow. Only where that was
// not enough, and the search comes back from the same place, more is recovered at once. False: there is no
// such step.
bool StopSearch::backtrack(int behind, const RatePlan& plan) {
  const RateWalk& here = checkpoints_[static_cast<std::size_t>(at_)];
  const bool passed = here.passed_s() > release_until_s_ + kPastS;
  deficit_share_ = passed ? kDeficitShare : std::min(1.0, deficit_share_ * kShareGrowth);
  double deficit = deficit_share_ * (feasible_slope(here) - here.slope()) + kDeficitMin;
  release_until_s_ = std::max(release_until_s_, here.passed_s());
  while (at_ > behind && released_[static_cast<std::size_t>(at_ - 1)]) --at_;
  if (at_ == behind) return false;
  for (; at_ > behind && deficit > 0; --at_) {
    const RateWalk& there = checkpoints_[static_cast<std::size_t>(at_ - 1)];
    const RateStep& step = plan.steps[static_cast<std::size_t>(at_ - 1)];
    deficit -= (release(there, there.bounds()) - step.u) * step.duration_s;
  }
  TRN_CHECK(at_ >= behind);
  release_from_ = at_;
  return true;
}

// As hard as the place allows, until the brake must be released.
double StopSearch::brake(const RateWalk& walk, const RateBounds& bounds) const {
  const double above = walk.rate() - to_, w = walk.slope(), margin = bounds.margin(StopSearch::kMargin);
  const double release_u = final_release(bounds);
  if (w < 0 && release_u > 0 && w * w >= 2 * above * release_u * (1 - kNear)) {
    const double exact = above > 0 ? w * w / (2 * above) : bounds.u_max;
    return std::min(bounds.u_max - margin, std::max(bounds.u_min + margin, exact));
  }
  const double to_slope = (kRetrySlopeUse * bounds.slope_min - w) / step_s_max_;
  return std::min(bounds.u_max - margin, std::max(bounds.u_min + margin, to_slope));
}

// What brings r' to 0 in the end. Where 3 r r' a helps it does so less and less on the way to rest.
double StopSearch::final_release(const RateBounds& bounds) const {
  return release_share_ * (to_ > 0 ? bounds.u_max : std::min(bounds.u_max, bounds.u_still));
}

}  // namespace trn
