#include "sim/servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

namespace trn {
namespace {

// Integral from 0 to t of the unit step response of wn^2 / (s^2 + 2 zeta wn s + wn^2) (Ogata, Modern Control
// Engineering, 5.3), through the complex poles: independent of the servo's own matrix form.
double integrated_step_response(double wn, double zeta, double t) {
  if (t <= 0) return 0;
  using C = std::complex<double>;
  const C root = std::sqrt(C(zeta * zeta - 1, 0));
  const C p1 = wn * (-zeta + root), p2 = wn * (-zeta - root);
  const C a = p2 / (p1 - p2), b = -p1 / (p1 - p2);  // y = 1 + a exp(p1 t) + b exp(p2 t)
  return (t + a * (std::exp(p1 * t) - 1.0) / p1 + b * (std::exp(p2 * t) - 1.0) / p2).real();
}

struct Loop {
  double wn, zeta;
};

class ServoStep : public testing::TestWithParam<Loop> {};

// A step of the setpoint reaches the loop as a ramp over one period (the drive interpolates), whose response
// is the mean of the step response over that period.
TEST_P(ServoStep, FollowsTheClosedFormSecondOrderResponse) {
  const auto [wn, zeta] = GetParam();
  const double period_s = 0.001;
  const Servo servo({wn, zeta, 0, period_s});
  Servo::State state;
  for (int k = 1; k <= 500; ++k) {
    servo.step(1.0, state);
    const double t = k * period_s;
    const double truth =
        (integrated_step_response(wn, zeta, t) - integrated_step_response(wn, zeta, t - period_s)) / period_s;
    ASSERT_NEAR(state.x, truth, 1e-9) << "at " << t << " s";
  }
}

INSTANTIATE_TEST_SUITE_P(Loops, ServoStep,
                         testing::Values(Loop{60, 0.1}, Loop{250, 0.7}, Loop{400, 0.999}, Loop{300, 2.5},
                                         Loop{3000, 0.5}));

TEST(Servo, IsContinuousThroughCriticalDamping) {
  Servo::State below, at;
  const Servo servo_below({200, 1 - 1e-9, 0, 0.001}), servo_at({200, 1, 0, 0.001});
  for (int k = 0; k < 100; ++k) {
    servo_below.step(1, below);
    servo_at.step(1, at);
    ASSERT_NEAR(below.x, at.x, 1e-8);
  }
}

// Without feed forward the lag at speed v is 2 zeta v / wn; with it there is none.
TEST(Servo, LagAtConstantSpeed) {
  for (const double feed_forward : {0.0, 0.5, 1.0}) {
    const Servo servo({250, 0.7, feed_forward, 0.001});
    Servo::State state;
    for (int k = 1; k <= 2000; ++k) servo.step(0.1 * k, state);
    EXPECT_NEAR(state.target - state.x, (1 - feed_forward) * 2 * 0.7 * 100 / 250, 1e-9);
    EXPECT_NEAR(state.v, 100, 1e-7);
  }
}

}  // namespace
}  // namespace trn
