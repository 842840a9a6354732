#include "compensation/offset_filter.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

constexpr double kTauMax = 1000;  // s

/// Absolute sums of the first three differences of the filter's impulse response.
struct Gains {
  double first = 0, second = 0, third = 0;
};

Gains gains_of(double gain) {
  Gains out;
  double z[3] = {0, 0, 0}, h[4] = {0, 0, 0, 0};
  // A pole 1 - gain decays by e in about 1 / gain periods. With three of them, what is left after sixty such
  // times is below the rounding of a double.
  const double rest = 60 / gain;  // the response has died away by then
  for (double i = 0; i < rest; ++i) {
    double in = i == 0 ? 1 : 0;
    for (double& stage : z) in = stage += gain * (in - stage);
    std::copy_backward(h, h + 3, h + 4);
    h[0] = in;
    out.first += std::abs(h[0] - h[1]);
    out.second += std::abs(h[0] - 2 * h[1] + h[2]);
    out.third += std::abs(h[0] - 3 * h[1] + 3 * h[2] - h[3]);
  }
  return out;
}

}  // namespace

OffsetFilter::OffsetFilter(double limit, double velocity, double acceleration, double jerk, double period_s)
    : limit_(limit) {
  const double T = period_s;
  // The worst sequence of targets switches between -limit and +limit just as the differenced impulse response
  // changes its sign, and reaches limit times the sum of its absolute values. A slower filter always fits if
  // a faster one does, so the smallest time constant is found by halving.
  const auto fits = [&](double tau) {
    const Gains g = gains_of(1 - std::exp(-T / tau));
    return limit * g.first <= velocity * T && limit * g.second <= acceleration * T * T &&
           limit * g.third <= jerk * T * T * T;
  };
  double low = T / 4, high = T;
  TRN_CHECK(limit > 0 && T > 0);
  TRN_CHECK(velocity > 0 && acceleration > 0 && jerk > 0);
  while (!fits(high) && high < kTauMax) high *= 2;
  for (int i = 0; i < 20; ++i) {
    // The geometric mean: tau may lie anywhere between a quarter of a period and 1000 s. Twenty halvings
    // settle it to the last digits that matter.
    const double mid = std::sqrt(low * high);
    (fits(mid) ? high : low) = mid;
  }
  tau_s_ = high;
  gain_ = 1 - std::exp(-T / high);
}

double OffsetFilter::step(double target) TRN_RT {
  // A target that is no number leaves the last one standing. A step to zero instead would throw the
  // correction away at once for the fault of a sensor.
  if (std::isfinite(target)) target_ = std::clamp(target, -limit_, limit_);
  TRN_CHECK(gain_ > 0 && gain_ <= 1);
  double in = target_;
  // Each stage takes what the one before has now, not what it had a period ago. The worst case is computed by
  // the same loop, so bound and filter are the same.
  for (double& stage : z_) in = stage += gain_ * (in - stage);
  return in;
}

void OffsetFilter::shift(double jump) TRN_RT {
  target_ += jump;
  TRN_CHECK(std::isfinite(jump));
  for (double& stage : z_) stage += jump;
}

}  // namespace trn
