#include "sim/servo.h"

#include <cmath>

#include "core/check.h"

namespace trn {

namespace {

// exp(A t) of e'' + 2 zeta wn e' + wn^2 e = 0. With d = wn sqrt(|zeta^2 - 1|), c and s are the cosine and
// sine over d (hyperbolic when overdamped); their limit at critical damping is 1 and t.
Eigen::Matrix2d transition(double wn, double zeta, double t) {
  const double decay = zeta * wn;
  const double d2 = wn * wn * (zeta * zeta - 1);
  const double d = std::sqrt(std::abs(d2));
  double c = 1, s = t;
  if (d * t > 1e-6) {
    c = d2 < 0 ? std::cos(d * t) : std::cosh(d * t);
    s = (d2 < 0 ? std::sin(d * t) : std::sinh(d * t)) / d;
  }
  Eigen::Matrix2d out;
  out << c + decay * s, s, -wn * wn * s, c - decay * s;
  return std::exp(-decay * t) * out;
}

}  // namespace

Servo::Servo(const Config& config)
    : config_(config),
      transition_(transition(config.natural_frequency_rad_s, config.damping, config.period_s)) {}

void Servo::step(double target, State& state) const TRN_RT {
  TRN_CHECK(config_.period_s > 0 && config_.natural_frequency_rad_s > 0);
  // The loop's equation is solved exactly for a target that moves evenly over the period. An integration in
  // steps would add an error that is not the drive's.
  const double slope = (target - state.target) / config_.period_s;
  // at constant speed the error settles here
  const double lag =
      2 * config_.damping * (1 - config_.velocity_feed_forward) * slope / config_.natural_frequency_rad_s;
  const Eigen::Vector2d error(state.x - state.target + lag, state.v - slope);
  const Eigen::Vector2d next = transition_ * error;
  state.x = target + next[0] - lag;
  state.v = slope + next[1];
  state.target = target;
}

}  // namespace trn
