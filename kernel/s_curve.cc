#include "kernel/s_curve.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

SCurve::SCurve(double distance, double velocity, double acceleration, double jerk) TRN_RT
    : jerk_(jerk),
      distance_(distance) {
  const double way = std::abs(distance);
  TRN_CHECK(std::isfinite(distance));
  TRN_CHECK(velocity > 0 && acceleration > 0 && jerk > 0);
  // Peak acceleration and speed that the way allows; the ramp to speed v takes v (t_jerk + t_flat/2 ...).
  const double a = std::min({acceleration, std::sqrt(velocity * jerk), std::cbrt(way * jerk * jerk / 2)});
  t_jerk_ = a / jerk;
  // Way of both ramps with a flat part f: (t_jerk + f)(2 t_jerk + f) a; the cruise takes what is left.
  const double flat_for_speed = std::max(0.0, velocity / a - t_jerk_);
  const double flat_for_way = a > 0 ? (-3 * t_jerk_ + std::sqrt(t_jerk_ * t_jerk_ + 4 * way / a)) / 2 : 0.0;
  t_flat_ = std::max(0.0, std::min(flat_for_speed, flat_for_way));
  v_peak_ = a * (t_jerk_ + t_flat_);
  const double ramps = (t_jerk_ + t_flat_) * (2 * t_jerk_ + t_flat_) * a;
  t_cruise_ = v_peak_ > 0 ? std::max(0.0, (way - ramps) / v_peak_) : 0.0;
}

double SCurve::ramp(double t) const TRN_RT {
  const double a = jerk_ * t_jerk_;
  if (t < t_jerk_) return jerk_ * t * t * t / 6;
  const double s1 = jerk_ * t_jerk_ * t_jerk_ * t_jerk_ / 6, v1 = a * t_jerk_ / 2;
  t -= t_jerk_;
  if (t < t_flat_) return s1 + t * (v1 + t * a / 2);
  const double s2 = s1 + t_flat_ * (v1 + t_flat_ * a / 2), v2 = v1 + a * t_flat_;
  t -= t_flat_;
  return s2 + t * (v2 + t * (a / 2 - jerk_ * t / 6));
}

double SCurve::at(double t_s) const TRN_RT {
  const double end = duration_s(), way = std::abs(distance_), half = 2 * t_jerk_ + t_flat_;
  if (t_s >= end || way == 0) return distance_;
  if (t_s <= 0) return 0;
  double s = 0;
  if (t_s < half) {
    s = ramp(t_s);
  } else if (t_s < half + t_cruise_) {
    s = ramp(half) + v_peak_ * (t_s - half);
  } else {
    s = way - ramp(end - t_s);
  }
  return distance_ < 0 ? -s : s;
}

}  // namespace trn
