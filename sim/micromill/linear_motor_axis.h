#pragma once

#include <array>
#include <complex>
#include <cstdint>

#include "core/realtime.h"
#include "sim/micromill/guide_friction.h"
#include "sim/micromill/noise.h"

namespace trn {

/// One axis of the micro-mill as it really is: linear motor with its amplifier, force ripple, guide friction,
/// encoder, and the drive's own position loop. docs/sources.md S5.1 gives the motors; everything else here is
/// the simulator's and is told to no estimator. mm, s, N, A, kg.
class LinearMotorAxis {
 public:
  static constexpr int kHarmonics = 4;

  struct Config {
    double force_N_A = 0;    ///< of the motor
    double mass_kg = 0;      ///< that really moves
    double damping_1_s = 0;  ///< speed-proportional drag over the mass (back-EMF)
    GuideFriction::Config friction;
    double magnet_pitch_mm = 30;
    std::array<double, kHarmonics> ripple_N{};  ///< amplitudes of the 1st, 2nd.. harmonic of the pitch
    std::array<double, kHarmonics> ripple_phase_rad{};
    // Drive: a PID position loop with feed-forward, three poles at one place; it believes force and mass
    // below.
    double loop_rad_s = 250;
    double derivative_lag_s = 0.0004;
    double force_nominal_N_A = 0, mass_nominal_kg = 0, damping_nominal_1_s = 0;
    double current_max_A = 20;
    double current_lag_s = 0.00015;  ///< of the current loop
    double current_noise_A = 0.01;   ///< of the current that flows, per drive period
    double current_step_A = 0.003;   ///< of the amplifier's command and of its reading
    double current_read_noise_A = 0.02;
    double encoder_step_mm = 0.0001;
    double encoder_noise_mm = 0.00005;
    int steps_per_drive_period = 6;  ///< simulation steps a period of the drive's loop
    std::uint64_t seed = 1;
  };

  explicit LinearMotorAxis(const Config& config);

  /// Stands at `x_mm`, loop closed there.
  void place(double x_mm);
  /// The setpoint of the end of the coming `duration_s`; interpolated linearly until then.
  void begin_period(double target_mm, double duration_s) TRN_RT;
  /// One simulation step with the force that acts on the moving part from outside.
  void step(double external_N, double dt_s) TRN_RT;
  /// Loop open, current zero (drive without power) or closed.
  void set_enabled(bool enabled) TRN_RT;

  double x_mm() const TRN_RT { return x_; }
  double v_mm_s() const TRN_RT { return v_; }
  double encoder_mm() TRN_RT;
  /// Mean of the amplifier's readings since the last call.
  double current_A() TRN_RT;
  double target_mm() const TRN_RT { return target_; }
  /// Truth for the judges: friction and ripple now, N, against the positive direction.
  double disturbance_N() const TRN_RT { return friction_N_ + ripple_now_N_; }

 private:
  void drive_loop(double dt_s) TRN_RT;
  double ripple_N(double x_mm) const TRN_RT;

  Config config_;
  GuideFriction friction_;
  NoiseSource noise_;
  std::array<std::complex<double>, kHarmonics> ripple_;  ///< amplitude and phase
  double x_ = 0, v_ = 0;
  double target_ = 0, target_slope_ = 0, slope_before_ = 0, target_curve_ = 0;
  double integral_ = 0, measured_before_ = 0, v_measured_ = 0;
  double command_A_ = 0, flowing_A_ = 0, flow_noise_A_ = 0;
  double reading_sum_A_ = 0;
  int readings_ = 0, steps_to_drive_ = 0;
  double friction_N_ = 0, ripple_now_N_ = 0;
  bool enabled_ = true;
};

}  // namespace trn
