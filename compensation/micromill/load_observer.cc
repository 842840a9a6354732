#include "compensation/micromill/load_observer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "core/solve_in_place.h"
#include "core/units.h"

namespace trn {

namespace {

double load_acceleration(const MotorModel& motor) { return 1000 / motor.mass_kg; }  // mm/s^2 per N

/// What a time T makes of state and current: the motor's equations (S5.2 for place, speed and load),
/// integrated exactly. The load has no law of its own: it is taken to change by white noise, so it stays.
struct Transition {
  Transition(const MotorModel& motor, double T_s) {
    const double z = motor.damping_1_s * T_s;
    // (z - 1 + e^-z) / z^2 as its series where the differences would cancel.
    double second = 0, term = 0.5;
    if (z < 1) {
      for (int k = 3; std::abs(term) > 1e-18; ++k) {
        second += term;
        term *= -z / k;
      }
    } else {
      second = (z + std::expm1(-z)) / (z * z);
    }
    const double decay = std::exp(-z);
    // How far a speed of 1 goes, and an acceleration of 1, while the damping slows both. The speed that an
    // acceleration of 1 gives is as far as a speed of 1 goes.
    const double by_speed = T_s * (1 - z * second), by_force = T_s * T_s * second;
    const double load = load_acceleration(motor);
    state << 1, by_speed, -load * by_force, 0, decay, -load * by_speed, 0, 0, 1;
    current << motor.gain_mm_s2_A * by_force, motor.gain_mm_s2_A * by_speed, 0;
  }
  Eigen::Matrix3d state;
  Eigen::Vector3d current;
};

// Roots of the cubic z^3 + a z^2 + b z + c: Cardano's, each polished by Newton's method.
std::array<std::complex<double>, 3> cubic_roots(double a, double b, double c) {
  using Complex = std::complex<double>;
  const double p = a * a - 3 * b, q = (2 * a * a - 9 * b) * a + 27 * c;
  const Complex root = std::sqrt(Complex(q * q - 4 * p * p * p));
  const Complex sum = q + (root.real() * q < 0 ? -root : root);  // of the two the one that does not cancel
  const Complex cube = std::pow(sum / 2.0, 1.0 / 3);
  std::array<Complex, 3> roots;
  for (int i = 0; i < 3; ++i) {
    const Complex turned = cube * std::polar(1.0, 2 * kPi * i / 3);
    Complex z = -(a + turned + (std::abs(turned) > 0 ? p / turned : 0)) / 3.0;
    // The formula loses digits where the coefficients differ by many powers of ten, as they do here: seconds,
    // and newtons over micrometres.
    for (int pass = 0; pass < 3; ++pass) {
      const Complex slope = (3.0 * z + 2 * a) * z + b;
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
Eigen::Vector3d gain_for(const Eigen::Matrix3d& transition, const std::array<std::complex<double>, 3>& z) {
  Eigen::Matrix3d seen;
  seen.row(0) = transition.row(0);
  seen.row(1) = seen.row(0) * transition;
  seen.row(2) = seen.row(1) * transition;
  Eigen::Vector3d gain = Eigen::Vector3d::UnitZ();
  solve_in_place(seen, gain);
  // Factor by factor: transition and poles are all next to 1, and the coefficients of the product would
  // cancel. Two of the poles may be a conjugate pair; the imaginary part comes to zero with the last factor.
  Eigen::Vector3d imaginary = Eigen::Vector3d::Zero();
  for (const std::complex<double>& pole : z) {
    const Eigen::Vector3d real = transition * gain - pole.real() * gain + pole.imag() * imaginary;
    imaginary = transition * imaginary - pole.real() * imaginary - pole.imag() * gain;
    gain = real;
  }
  return gain;
}

}  // namespace

LoadObserver::LoadObserver(const Config& config)
    : config_(config), filter_(kalman_bucy(config.motor, config.noise)) {
  const Transition period(config.motor, config.period_s);
  predict_ = period.state;
  predict_current_ = period.current;  // it is held over a period
  const double span_s = config.measure_every * config.period_s;
  predict_span_ = Transition(config.motor, span_s).state;
  // Poles by time, e^(pole T): the continuous filter's error decays as fast from one position to the next.
  // The gain of Kalman and Bucy times T would be right for short T only and may be unstable for long ones.
  std::array<std::complex<double>, 3> poles;
  for (int i = 0; i < 3; ++i) poles[static_cast<std::size_t>(i)] = std::exp(filter_.poles[i] * span_s);
  gain_ = gain_for(predict_span_, poles);
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
  // From one position to the next the estimate follows by x = P x + gain (turn X - P.row(0) x), with P the
  // prediction. P is triangular, so (turn - P) w = gain is solved from the load upward; the row that looks at
  // the position then only scales w.
  const Eigen::Matrix3d& P = predict_span_;
  const Complex load = gain_[2] / (turn - P(2, 2));
  const Complex speed = (gain_[1] + P(1, 2) * load) / (turn - P(1, 1));
  const Complex place = (gain_[0] + P(0, 1) * speed + P(0, 2) * load) / (turn - P(0, 0));
  const Complex looked = P(0, 0) * place + P(0, 1) * speed + P(0, 2) * load;
  return load * X * turn / (1.0 + looked);
}

}  // namespace trn
