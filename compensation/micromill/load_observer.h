#pragma once

#include <Eigen/Dense>
#include <complex>

#include "core/realtime.h"

namespace trn {

/// A linear motor (docs/sources.md S5.2): x'' = -damping x' + gain u - (1000 / mass) F, in mm, s, A, N.
struct MotorModel {
  double gain_mm_s2_A = 0;  ///< J
  double damping_1_s = 0;   ///< alpha
  double mass_kg = 0;       ///< M
};

/// Intensities of the white noises that the filter's gain balances (docs/sources.md S5.3).
struct LoadNoise {
  double current_A = 0;      ///< sigma_u
  double load_rate_N_s = 0;  ///< sigma_w
  double position_mm = 0;    ///< sigma_p
};

/// Steady-state Kalman-Bucy filter for (position mm, speed mm/s, load N).
struct KalmanBucy {
  Eigen::Vector3d gain;    ///< K
  Eigen::Matrix3d P;       ///< covariance of the estimate
  Eigen::Vector3cd poles;  ///< of the estimate's error, 1/s
};

/// Solves A P + P A^T + Q - P C^T C P / sigma_p^2 = 0 in closed form: with one measurement the poles of the
/// filter are the stable roots of a polynomial whose squares are the roots of a cubic (spectral
/// factorization, Kailath, Linear Systems, 3.4). All of `motor` and `noise` positive.
KalmanBucy kalman_bucy(const MotorModel& motor, const LoadNoise& noise);

/// The filter in discrete time. The motor's model is integrated exactly over a period of constant current,
/// and the gain gives the estimate's error exactly the decay of the Kalman-Bucy filter, e^(pole * T),
/// whatever the time T from one position to the next: positions may come more seldom than currents
/// (multi-rate), and for short T the gain over T is Kalman and Bucy's. A constant load is found without error
/// whatever the currents do.
class LoadObserver {
 public:
  struct Config {
    MotorModel motor;
    LoadNoise noise;
    double period_s = 0;
    int measure_every = 1;  ///< periods from one position to the next
  };
  struct State {
    /// Position mm, speed mm/s, load N against the motor.
    Eigen::Vector3d estimate = Eigen::Vector3d::Zero();
    double innovation_mm = 0;  ///< measured minus predicted, at the last measurement
    int age = 0;               ///< periods since then
    bool started = false;
  };

  explicit LoadObserver(const Config& config);

  /// One period with the mean current during it and the position at its end; the position is used every
  /// `measure_every` periods, beginning with the first.
  void step(double current_A, double position_mm, State& state) const TRN_RT;

  const KalmanBucy& filter() const { return filter_; }
  /// What a position corrects of the estimate, per mm of innovation.
  const Eigen::Vector3d& gain() const { return gain_; }
  /// Response from true to estimated load, complex, at an angular frequency below pi / T.
  std::complex<double> load_response(double omega_rad_s) const;

 private:
  Config config_;
  KalmanBucy filter_;
  Eigen::Matrix3d predict_, predict_span_;  ///< by the model: over a period, from position to position
  Eigen::Vector3d predict_current_, gain_;
};

}  // namespace trn
