#include "compensation/micromill/load_observer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/MatrixFunctions>

namespace trn {

namespace {

double load_acceleration(const MotorModel& motor) { return 1000 / motor.mass_kg; }  // mm/s^2 per N

Eigen::Matrix3d system(const MotorModel& motor) {
  Eigen::Matrix3d A;
  // The rows of S5.2 for place, speed and load. The load has no law of its own: it is taken to change by
  // white noise, so its row is zero.
  A << 0, 1, 0, 0, -motor.damping_1_s, -load_acceleration(motor), 0, 0, 0;
  return A;
}

// Roots of the cubic z^3 + a z^2 + b z + c, each polished by Newton's method.
std::array<std::complex<double>, 3> cubic_roots(double a, double b, double c) {
  Eigen::Matrix3d companion;
  companion << 0, 0, -c, 1, 0, -b, 0, 1, -a;
  const Eigen::Vector3cd start = companion.eigenvalues();
  std::array<std::complex<double>, 3> roots;
  for (int i = 0; i < 3; ++i) {
    std::complex<double> z = start[i];
    // The eigenvalues of a companion matrix lose digits where its entries differ by many powers of ten, as
    // they do here: seconds, and newtons over micrometres.
    for (int pass = 0; pass < 3; ++pass) {
      const std::complex<double> slope = (3.0 * z + 2 * a) * z + b;
      if (std::abs(slope) > 0) z -= (((z + a) * z + b) * z + c) / slope;
    }
    roots[static_cast<std::size_t>(i)] = z;
  }
  return roots;
}

}  // namespace

KalmanBucy kalman_bucy(const MotorModel& motor, const LoadNoise& noise) {
  const double alpha = motor.damping_1_s, b = load_acceleration(motor);
  // All noises are divided by that of the position. What the filter does depends on these ratios only.
  const double r = noise.position_mm * noise.position_mm;
  const double current = motor.gain_mm_s2_A * noise.current_A / noise.position_mm;
  const double load = b * noise.load_rate_N_s / noise.position_mm;
  std::array<std::complex<double>, 3> pole;
  const auto squares = cubic_roots(-alpha * alpha, current * current, -load * load);
  // Spectral factorization: the numerator of 1 + G(s) Q G(-s) / sigma_p^2 is a polynomial in s^2, and the
  // filter has those of its roots that lie left of the axis. The square root with a positive real part is
  // minus such a pole.
  std::transform(squares.begin(), squares.end(), pole.begin(), [](auto z) { return std::sqrt(z); });
  const double c2 = (pole[0] + pole[1] + pole[2]).real();
  const double c1 = (pole[0] * pole[1] + pole[1] * pole[2] + pole[2] * pole[0]).real();
  KalmanBucy out;
  for (int i = 0; i < 3; ++i) out.poles[i] = -pole[static_cast<std::size_t>(i)];
  // The filter's characteristic polynomial is s^3 + (alpha + k1) s^2 + (alpha k1 + k2) s - b k3. Comparing it
  // with that of the poles gives the gains one after the other.
  const double k1 = c2 - alpha, k2 = c1 - alpha * k1, k3 = -load / b;
  out.gain << k1, k2, k3;
  // The Riccati equation gives the rest of P, one entry after the other.
  Eigen::Matrix3d& P = out.P;
  P(0, 0) = r * k1;
  P(0, 1) = P(1, 0) = r * k2;
  P(0, 2) = P(2, 0) = r * k3;
  P(1, 1) = r * (alpha * k2 + b * k3 + k1 * k2);
  P(1, 2) = P(2, 1) = r * k1 * k3;
  P(2, 2) = -(alpha * P(1, 2) + r * k2 * k3) / b;
  return out;
}

namespace {

// Gain that gives the error, which a position corrects after `transition`, the poles `z` (Ackermann's formula
// on the pair of transition and predicted position; Kailath, Linear Systems, 3.2).
Eigen::Vector3d gain_for(const Eigen::Matrix3d& transition, const Eigen::Vector3cd& z) {
  Eigen::Matrix3d seen;
  seen.row(0) = transition.row(0);
  seen.row(1) = seen.row(0) * transition;
  seen.row(2) = seen.row(1) * transition;
  Eigen::Matrix3cd polynomial = Eigen::Matrix3cd::Identity();
  for (int i = 0; i < 3; ++i)
    polynomial *= transition.cast<std::complex<double>>() - z[i] * Eigen::Matrix3cd::Identity();
  return polynomial.real() * seen.fullPivLu().solve(Eigen::Vector3d::UnitZ());
}

}  // namespace

LoadObserver::LoadObserver(const Config& config)
    : config_(config), filter_(kalman_bucy(config.motor, config.noise)) {
  // The current is held over a period. With it as a fourth state that does not change, one matrix exponential
  // gives both what the state and what the current become.
  Eigen::Matrix4d driven = Eigen::Matrix4d::Zero();  // the last one is the current
  driven.topLeftCorner<3, 3>() = system(config.motor);
  driven(1, 3) = config.motor.gain_mm_s2_A;
  const Eigen::Matrix4d period = (driven * config.period_s).exp();
  predict_ = period.topLeftCorner<3, 3>();
  predict_current_ = period.block<3, 1>(0, 3);
  const double span_s = config.measure_every * config.period_s;
  predict_span_ = (system(config.motor) * span_s).exp();
  // Poles by time, e^(pole T): the continuous filter's error decays as fast from one position to the next.
  // The gain of Kalman and Bucy times T would be right for short T only and may be unstable for long ones.
  gain_ = gain_for(predict_span_, (filter_.poles * span_s).array().exp());
}

void LoadObserver::step(double current_A, double position_mm, State& state) const TRN_RT {
  if (!state.started) {
    state = State{};
    state.started = true;
    state.estimate[0] = position_mm;
    return;
  }
  state.estimate = predict_ * state.estimate + predict_current_ * current_A;
  // Currents come with every period, positions perhaps with every tenth. In between the model goes on alone,
  // which its exact integration allows.
  if (++state.age < config_.measure_every) return;
  state.age = 0;
  state.innovation_mm = position_mm - state.estimate[0];
  state.estimate += gain_ * state.innovation_mm;
}

std::complex<double> LoadObserver::load_response(double omega_rad_s) const {
  // The load swings the true position by X; the estimate follows from position to position.
  using Complex = std::complex<double>;
  const Complex s(0, omega_rad_s);
  const Complex X = -load_acceleration(config_.motor) / (s * (s + config_.motor.damping_1_s));
  const Complex turn = std::exp(s * (config_.measure_every * config_.period_s));
  // Behind a measurement the error is what the prediction leaves of it, less what the gain takes back of the
  // position.
  const Eigen::Matrix3d kept = predict_span_ - gain_ * predict_span_.row(0);
  const Eigen::Matrix3cd follow = turn * Eigen::Matrix3cd::Identity() - kept.cast<Complex>();
  const Eigen::Vector3cd estimate = follow.partialPivLu().solve(gain_.cast<Complex>() * (X * turn));
  return estimate[2];
}

}  // namespace trn
