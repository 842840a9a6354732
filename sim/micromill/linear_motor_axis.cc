#include "sim/micromill/linear_motor_axis.h"

#include <algorithm>

#include "core/units.h"

namespace trn {

namespace {
constexpr double kMmPerM = 1000;
}

LinearMotorAxis::LinearMotorAxis(const Config& config)
    : config_(config), friction_(config.friction), noise_(config.seed) {
  for (std::size_t k = 0; k < kHarmonics; ++k)
    ripple_[k] = std::polar(config.ripple_N[k], config.ripple_phase_rad[k]);
}

void LinearMotorAxis::place(double x_mm) {
  x_ = target_ = measured_before_ = x_mm;
  v_ = v_measured_ = target_slope_ = slope_before_ = target_curve_ = integral_ = 0;
}

void LinearMotorAxis::set_enabled(bool enabled) TRN_RT {
  // The loop begins at rest, without a memory of the time when the axis was pushed about by hand.
  if (enabled && !enabled_) {
    target_ = measured_before_ = x_;
    target_slope_ = slope_before_ = target_curve_ = integral_ = v_measured_ = 0;
  }
  enabled_ = enabled;
}

void LinearMotorAxis::begin_period(double target_mm, double duration_s) TRN_RT {
  slope_before_ = target_slope_;
  target_slope_ = (target_mm - target_) / duration_s;
  target_curve_ = (target_slope_ - slope_before_) / duration_s;
}

void LinearMotorAxis::step(double external_N, double dt_s) TRN_RT {
  target_ += target_slope_ * dt_s;
  // The amplifier closes its loop several times in a period of the control, but more seldom than the
  // mechanics are computed.
  if (steps_to_drive_-- <= 0) {
    steps_to_drive_ = config_.steps_per_drive_period - 1;
    drive_loop(dt_s * config_.steps_per_drive_period);
  }
  flowing_A_ += (command_A_ - flowing_A_) * std::min(1.0, dt_s / config_.current_lag_s);
  friction_N_ = friction_.step(v_, dt_s);
  ripple_now_N_ = ripple_N(x_);
  const double motor_N = config_.force_N_A * (flowing_A_ + flow_noise_A_);
  const double sum_N = motor_N - friction_N_ - ripple_now_N_ + external_N;
  v_ += dt_s * (kMmPerM * sum_N / config_.mass_kg - config_.damping_1_s * v_);
  // The new speed moves the place (semi-implicit Euler): so a swinging system does not gain energy from the
  // steps.
  x_ += dt_s * v_;
}

void LinearMotorAxis::drive_loop(double dt_s) TRN_RT {
  const double measured = encoder_mm();
  const double slope = (measured - measured_before_) / dt_s;
  measured_before_ = measured;
  v_measured_ += (slope - v_measured_) * std::min(1.0, dt_s / config_.derivative_lag_s);
  flow_noise_A_ = enabled_ ? config_.current_noise_A * noise_.gaussian() : 0;
  command_A_ = 0;
  if (enabled_) {
    const double w = config_.loop_rad_s, error = target_ - measured;
    // PID with three equal poles at -w: (s + w)^3 = s^3 + 3 w s^2 + 3 w^2 s + w^3, with acceleration and
    // damping of the target fed forward.
    const double wanted = target_curve_ + config_.damping_nominal_1_s * target_slope_ +
                          3 * w * (target_slope_ - v_measured_) + 3 * w * w * error + w * w * w * integral_;
    const double per_A = kMmPerM * config_.force_nominal_N_A / config_.mass_nominal_kg;
    const double unlimited = wanted / per_A;
    command_A_ = quantised(std::clamp(unlimited, -config_.current_max_A, config_.current_max_A),
                           config_.current_step_A);
    if (std::abs(unlimited) < config_.current_max_A) integral_ += dt_s * error;  // else it would wind up
  }
  // What the drive tells has the noise of its own measurement on top of the current that really flows.
  const double reading = flowing_A_ + flow_noise_A_ + config_.current_read_noise_A * noise_.gaussian();
  reading_sum_A_ += quantised(reading, config_.current_step_A);
  ++readings_;
}

double LinearMotorAxis::ripple_N(double x_mm) const TRN_RT {
  // The harmonics are the powers of one rotation, so a single sine and cosine give all of them.
  const std::complex<double> turn = std::polar(1.0, 2 * kPi * x_mm / config_.magnet_pitch_mm);
  std::complex<double> harmonic = turn;
  double sum = 0;
  for (const std::complex<double>& ripple : ripple_) {
    sum += ripple.real() * harmonic.imag() + ripple.imag() * harmonic.real();
    harmonic = {harmonic.real() * turn.real() - harmonic.imag() * turn.imag(),
                harmonic.real() * turn.imag() + harmonic.imag() * turn.real()};
  }
  return sum;
}

double LinearMotorAxis::encoder_mm() TRN_RT {
  return quantised(x_ + config_.encoder_noise_mm * noise_.gaussian(), config_.encoder_step_mm);
}

double LinearMotorAxis::current_A() TRN_RT {
  const double mean = readings_ ? reading_sum_A_ / readings_ : 0.0;
  reading_sum_A_ = 0;
  readings_ = 0;
  return mean;
}

}  // namespace trn
