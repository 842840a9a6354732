#include "sim/micromill/linear_motor_axis.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

constexpr double kPi = 3.14159265358979323846;

// 40 N/A on 4 kg without friction, ripple or noise.
LinearMotorAxis::Config ideal() {
  LinearMotorAxis::Config config;
  config.force_N_A = config.force_nominal_N_A = 40;
  config.mass_kg = config.mass_nominal_kg = 4;
  config.friction.coulomb_up_N = config.friction.coulomb_down_N = 1e-12;
  config.friction.static_up_N = config.friction.static_down_N = 1e-12;
  config.current_noise_A = config.current_read_noise_A = config.encoder_noise_mm = 0;
  return config;
}

TEST(LinearMotorAxis, RippleIsTheSumOfItsHarmonics) {
  LinearMotorAxis::Config config = ideal();
  config.magnet_pitch_mm = 24;
  config.ripple_N = {3, 1.5, 0.7, 0.2};
  config.ripple_phase_rad = {0.3, -1.1, 2, 4};
  for (double x = -30; x < 30; x += 0.37) {
    LinearMotorAxis axis(config);
    axis.place(x);
    axis.set_enabled(false);
    axis.step(0, 1e-6);
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k)
      sum += config.ripple_N[k] *
             std::sin(2 * kPi * static_cast<double>(k + 1) * x / 24 + config.ripple_phase_rad[k]);
    ASSERT_NEAR(axis.disturbance_N(), sum, 1e-9) << x;
  }
}

// m dv/dt = F - m d v, from rest: v = F / (m d) (1 - exp(-d t)).
TEST(LinearMotorAxis, WithoutPowerAForcePushesItAgainstTheDrag) {
  LinearMotorAxis::Config config = ideal();
  config.damping_1_s = 5;
  LinearMotorAxis axis(config);
  axis.place(2);
  axis.set_enabled(false);
  const double dt = 1e-5, end_v = 1000 * 0.8 / (4 * 5);
  for (int k = 1; k <= 50000; ++k) {
    axis.step(0.8, dt);
    ASSERT_NEAR(axis.v_mm_s(), end_v * -std::expm1(-5 * k * dt), 1e-3 * end_v);
  }
  EXPECT_NEAR(axis.x_mm(), 2 + end_v * (0.5 + std::expm1(-5 * 0.5) / 5), 1e-3);
  EXPECT_NEAR(axis.current_A(), 0, 1e-12);
}

TEST(LinearMotorAxis, TheLoopHoldsALoadWithTheCurrentThatItNeeds) {
  for (const double load_N : {-12.0, 6.0}) {
    LinearMotorAxis axis(ideal());
    axis.place(7);
    for (int k = 0; k < 48000; ++k) axis.step(load_N, 1.0 / 48000);
    axis.current_A();
    for (int k = 0; k < 4800; ++k) axis.step(load_N, 1.0 / 48000);
    EXPECT_NEAR(axis.current_A(), -load_N / 40, 0.003) << "a step of the amplifier";
    EXPECT_NEAR(axis.x_mm(), 7, 2e-4) << "two steps of the encoder";
  }
}

// Opened, the loop forgets where it was to be; closed, it holds where it then stands.
TEST(LinearMotorAxis, ClosedAnewItHoldsWhereItStands) {
  LinearMotorAxis axis(ideal());
  axis.place(0);
  axis.begin_period(0.5, 0.01);
  for (int k = 0; k < 480; ++k) axis.step(0, 1.0 / 48000);
  axis.begin_period(0.5, 1);
  axis.set_enabled(false);
  for (int k = 0; k < 4800; ++k) axis.step(-20, 1.0 / 48000);
  const double here = axis.x_mm();
  ASSERT_LT(here, -5) << "pushed away";
  axis.set_enabled(true);
  EXPECT_EQ(axis.target_mm(), here);
  for (int k = 0; k < 96000; ++k) axis.step(0, 1.0 / 48000);
  EXPECT_NEAR(axis.v_mm_s(), 0, 0.05);
  EXPECT_NEAR(axis.x_mm(), here, 1e-3);
}

}  // namespace
}  // namespace trn
