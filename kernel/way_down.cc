#include "kernel/way_down.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kHereMargin = 0.003;  // of the range of u, where a mended step begins
constexpr double kSlopeUse = 0.98;
constexpr int kMends = 3;
constexpr double kNearS = 1e-12, kNear = 1e-9;
constexpr double kRest = 1e-9;       // of the rate: no difference
constexpr double kLackShare = 0.08;  // of what r' is too low by, made up for in one go back
constexpr double kLackMin = 1e-6;
constexpr int kSlopes = 8;        // looked at for the r' that a place bears
constexpr double kLowRate = 0.1;  // below, r' must come to 0 before the rate does

// How long u < 0 may go on until `ease` is what brings rate and slope to 0 together: (w + u t)^2 =
// 2 ease (r + w t + u t^2 / 2). So the end of a stop does not hang on where a walk's steps begin.
double time_to_ease(double r, double w, double u, double ease) TRN_RT {
  const double never = std::numeric_limits<double>::infinity();
  if (u >= 0 || ease <= 0) return never;
  const double p = w / u, q = (w * w - 2 * ease * r) / (u * (u - ease)), root = p * p - q;
  if (root < 0) return never;
  const double t = -p + std::sqrt(root);
  return t > 0 ? t : never;
}

// Off the brake: r' comes back to 0.
double release(const PlanWalk& walk, const RateBounds& bounds) TRN_RT {
  const double most = bounds.u_max - bounds.margin(Way::kMargin);
  return walk.slope() < 0 ? most : std::min(0.0, most);
}

// The lowest r' above the present one that its place seems to bear at this rate.
double bearable_slope(PlanWalk walk) TRN_RT {
  const double r = walk.rate(), w = walk.slope();
  for (int i = kSlopes - 1; i > 0; --i) {
    const double tried = w * i / kSlopes;
    walk.set_rate(r, tried);
    const RateBounds bounds = walk.bounds();
    const bool comes_to_rest = r > kLowRate || tried * tried < 2 * r * bounds.u_max;
    if (bounds.legal && tried > bounds.slope_min && comes_to_rest) return tried;
  }
  return 0;
}

}  // namespace

double Way::time_s(int from) const TRN_RT {
  double sum = 0;
  for (int i = from; i < count; ++i) sum += steps[static_cast<std::size_t>(i)].duration_s;
  return sum;
}

double WayDown::find(const PlanWalk& from, double to, double early, int& work, Way& way) TRN_RT {
  const int behind = way.count;
  TRN_CHECK(behind >= 0 && behind <= PlanWalk::kStepsMax);
  TRN_CHECK(to >= 0 && to <= 1);
  TRN_CHECK(early > 0 && early < 1);
  to_ = to;
  early_ = early;
  at_ = behind;
  off_from_ = PlanWalk::kStepsMax;
  off_until_s_ = 0;
  marks_[static_cast<std::size_t>(at_)] = from;
  way.stops = to == 0;
  way.turn_rate = way.end_rate = to;
  while (work-- > 0) {
    const auto k = static_cast<std::size_t>(at_);
    TRN_CHECK(at_ >= behind);
    const PlanWalk& here = marks_[k];
    way.count = at_;
    if (here.ended()) {
      way.end_rate = std::min(here.rate(), 1.0);
      return here.passed_s();
    }
    if (here.slope() == 0 && here.rate() <= to + kRest)
      return here.rate() < to - kRest ? -1 : here.passed_s();  // not from below
    if (at_ == PlanWalk::kStepsMax) return -1;
    const RateBounds bounds = here.bounds();
    const bool off = at_ >= off_from_ && here.passed_s() < off_until_s_;
    if (bounds.legal && go_on(here, bounds, off, way.steps[k], marks_[k + 1])) {
      off_[k] = off || (here.slope() < 0 && way.steps[k].u >= 0);
      ++at_;
    } else if (!go_back(behind, way)) {
      return -1;
    }
  }
  return -1;
}

// One step, at most to where r' has become 0 or `ease` is what brings both there. Where u breaks a bound at
// the end of the step, that bound is taken into account, within the bounds here.
bool WayDown::go_on(const PlanWalk& here, const RateBounds& bounds, bool off_the_brake, RateStep& step,
                    PlanWalk& next) const TRN_RT {
  const double w = here.slope(), ease = ease_of(bounds), margin_here = bounds.margin(kHereMargin);
  double u = off_the_brake ? release(here, bounds) : brake(here, bounds);
  for (int i = 0; i < kMends; ++i) {
    const double to_turn = u * w < 0 ? -w / u : std::numeric_limits<double>::infinity();
    next = here;
    const double gone = next.step(u, std::min(to_turn, time_to_ease(here.rate() - to_, w, u, ease)));
    if (gone >= 0) {
      step = {gone, u};
      TRN_CHECK(std::isfinite(u));
      if (gone >= to_turn - kNearS) next.set_rate(next.rate(), 0);
      return true;
    }
    const RateBounds end = next.bounds();
    const double margin = end.margin(Way::kMargin);
    if (!end.legal) return false;
    const double to_slope = (kSlopeUse * end.slope_min - w) / step_s_max_;
    u = std::clamp(u, std::min(end.u_max - margin, std::max(end.u_min + margin, to_slope)),
                   end.u_max - margin);
    if (u < bounds.u_min + margin_here || u > bounds.u_max - margin_here) return false;
  }
  return false;
}

// To where coming off the brake makes up for a share of what r' is too low by here: only a share, since what
// is gained there goes on to grow, and a way that was eased too much is slow. False: there is no such place.
bool WayDown::go_back(int behind, const Way& way) TRN_RT {
  const PlanWalk& here = marks_[static_cast<std::size_t>(at_)];
  double lack = kLackShare * (bearable_slope(here) - here.slope()) + kLackMin;
  off_until_s_ = std::max(off_until_s_, here.passed_s());
  while (at_ > behind && off_[static_cast<std::size_t>(at_ - 1)]) --at_;
  if (at_ == behind) return false;
  for (; at_ > behind && lack > 0; --at_) {
    const PlanWalk& there = marks_[static_cast<std::size_t>(at_ - 1)];
    const RateStep& step = way.steps[static_cast<std::size_t>(at_ - 1)];
    lack -= (release(there, there.bounds()) - step.u) * step.duration_s;
  }
  TRN_CHECK(at_ >= behind);
  off_from_ = at_;
  return true;
}

// Down as fast as it goes, and in time off the brake.
double WayDown::brake(const PlanWalk& walk, const RateBounds& bounds) const TRN_RT {
  const double above = walk.rate() - to_, w = walk.slope(), margin = bounds.margin(Way::kMargin);
  const double ease = ease_of(bounds);
  if (w < 0 && ease > 0 && w * w >= 2 * above * ease * (1 - kNear)) {
    const double exact = above > 0 ? w * w / (2 * above) : bounds.u_max;
    return std::min(bounds.u_max - margin, std::max(bounds.u_min + margin, exact));
  }
  const double to_slope = (kSlopeUse * bounds.slope_min - w) / step_s_max_;
  return std::min(bounds.u_max - margin, std::max(bounds.u_min + margin, to_slope));
}

// What brings r' to 0 in the end. Where 3 r r' a helps it does so less and less on the way to rest.
double WayDown::ease_of(const RateBounds& bounds) const TRN_RT {
  return early_ * (to_ > 0 ? bounds.u_max : std::min(bounds.u_max, bounds.u_still));
}

}  // namespace trn
