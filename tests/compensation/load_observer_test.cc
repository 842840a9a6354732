#include "compensation/micromill/load_observer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/units.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

struct Case {
  MotorModel motor;
  LoadNoise noise;
  Eigen::Vector3d gain;
  Eigen::Matrix3d P;
};

/// Of a matrix: z^3 + c2 z^2 + c1 z + c0, whose roots are its eigenvalues.
struct Polynomial {
  explicit Polynomial(const Eigen::Matrix3d& A) : c2(-A.trace()), c1(0), c0(-A.determinant()) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Eigen::Index k = (i + 1) % 3;
      c1 += A(i, i) * A(k, k) - A(i, k) * A(k, i);
    }
  }
  double c2, c1, c0;
};

/// Its series for a 2^20th of the matrix, squared twenty times.
Eigen::Matrix3d exponential(const Eigen::Matrix3d& A) {
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity(), small = Eigen::Matrix3d::Zero();
  for (int k = 1; k < 8; ++k) {
    term = Eigen::Matrix3d(term * A) * (0x1p-20 / k);
    small += term;  // without the identity, whose digits would take theirs
  }
  for (int k = 0; k < 20; ++k) small = Eigen::Matrix3d(2 * small + small * small);
  return small + Eigen::Matrix3d::Identity();
}

std::vector<Case> vectors() {
  std::ifstream file(source_dir() + "/tests/data/vectors/kalman_gain.json");
  const nlohmann::json root = nlohmann::json::parse(file);
  std::vector<Case> out;
  for (const auto& row : root.at("rows")) {
    Case c;
    c.motor = {row.at("J"), row.at("alpha"), row.at("mass_kg")};
    c.noise = {row.at("sigma_current"), row.at("sigma_load_rate"), row.at("sigma_position")};
    for (int i = 0; i < 3; ++i) {
      c.gain[i] = row.at("gain")[i];
      for (int j = 0; j < 3; ++j) c.P(i, j) = row.at("P")[i][j];
    }
    out.push_back(c);
  }
  return out;
}

TEST(KalmanBucy, GainsAndCovariancesEqualTheVectors) {
  const std::vector<Case> cases = vectors();
  ASSERT_EQ(cases.size(), 2u);
  for (const Case& c : cases) {
    const KalmanBucy filter = kalman_bucy(c.motor, c.noise);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(filter.gain[i] / c.gain[i], 1, 1e-9);
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(filter.P(i, j) / c.P(i, j), 1, 1e-9);
    }
  }
}

// Any motor: P solves the Riccati equation, is positive definite, and the filter is stable.
TEST(KalmanBucy, SolvesTheRiccatiEquation) {
  for (int k = 0; k < 200; ++k) {
    const auto spread = [&](double base, int step) { return base * std::pow(1.6, (k * step) % 9 - 4); };
    const MotorModel motor{spread(1000, 1), spread(5, 2), spread(3, 4)};
    const LoadNoise noise{spread(0.01, 5), spread(100, 7), spread(2e-4, 8)};
    const KalmanBucy filter = kalman_bucy(motor, noise);
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    A(0, 1) = 1;
    A(1, 1) = -motor.damping_1_s;
    A(1, 2) = -1000 / motor.mass_kg;
    const Eigen::Vector3d C(1, 0, 0);
    const double r = noise.position_mm * noise.position_mm;
    const Eigen::Vector3d q(0, std::pow(motor.gain_mm_s2_A * noise.current_A, 2),
                            std::pow(noise.load_rate_N_s, 2));
    const Eigen::Matrix3d& P = filter.P;
    const Eigen::Matrix3d flow = A * P, gained = P * C * C.transpose() * P / r;
    const Eigen::Matrix3d left = flow + flow.transpose() + Eigen::Matrix3d(q.asDiagonal()) - gained;
    const Eigen::Matrix3d size = flow.cwiseAbs() + flow.transpose().cwiseAbs() + gained.cwiseAbs();
    EXPECT_LT((left.array() / size.array()).abs().maxCoeff(), 1e-10) << k;
    EXPECT_GT(P.determinant(), 0);
    const Eigen::Matrix3d closed = A - filter.gain * C.transpose();
    const Polynomial left_of_axis(closed);  // by Hurwitz' criterion
    EXPECT_GT(left_of_axis.c2, 0);
    EXPECT_GT(left_of_axis.c0, 0);
    EXPECT_GT(left_of_axis.c2 * left_of_axis.c1, left_of_axis.c0);
  }
}

/// The motor integrated by its own closed form: constant current and load over a period.
struct Motor {
  MotorModel model;
  double x = 0, v = 0;
  void step(double current_A, double load_N, double t) {
    const double a = model.gain_mm_s2_A * current_A - 1000 / model.mass_kg * load_N, d = model.damping_1_s;
    const double decay = std::exp(-d * t), settled = a / d;
    x += settled * t + (v - settled) * (1 - decay) / d;
    v = settled + (v - settled) * decay;
  }
};

class ObserverRate : public testing::TestWithParam<int> {};

// A constant load is found without error, whatever the current does and however seldom the position comes.
TEST_P(ObserverRate, FindsAConstantLoad) {
  const Case c = vectors()[0];
  const int every = GetParam();
  const LoadObserver observer({c.motor, c.noise, 0.001, every});
  LoadObserver::State state;
  Motor motor{c.motor};
  observer.step(0, motor.x, state);
  for (int k = 0; k < 2000; ++k) {
    const double current = 1.5 + std::sin(0.05 * k);
    motor.step(current, 5.0, 0.001);
    observer.step(current, (k + 1) % every == 0 ? motor.x : 1e9, state);  // the others are not looked at
  }
  EXPECT_NEAR(state.estimate[2], 5.0, 1e-4);
  EXPECT_NEAR(state.estimate[0], motor.x, 1e-7);
}
INSTANTIATE_TEST_SUITE_P(Rates, ObserverRate, testing::Values(1, 2, 4, 8));

// From position to position the error of the estimate obeys the polynomial of the poles e^(pole T), where the
// poles are those of the continuous filter with the vectors' gain.
TEST_P(ObserverRate, TheErrorDecaysAsInTheContinuousFilter) {
  for (const Case& c : vectors()) {
    Eigen::Matrix3d A;
    A << -c.gain[0], 1, 0, -c.gain[1], -c.motor.damping_1_s, -1000 / c.motor.mass_kg, -c.gain[2], 0, 0;
    const Polynomial poles(exponential(A * (0.001 * GetParam())));
    const LoadObserver observer({c.motor, c.noise, 0.001, GetParam()});
    LoadObserver::State state;
    Motor motor{c.motor};
    observer.step(0, motor.x, state);
    std::vector<double> error;
    for (int k = 0; k < 30 * GetParam(); ++k) {
      motor.step(0.3, 5.0, 0.001);
      observer.step(0.3, motor.x, state);
      if ((k + 1) % GetParam() == 0) error.push_back(state.estimate[2] - 5);
    }
    for (std::size_t k = 3; k < error.size(); ++k)
      ASSERT_NEAR(error[k], -poles.c2 * error[k - 1] - poles.c1 * error[k - 2] - poles.c0 * error[k - 3],
                  1e-6)
          << k;
  }
}

// For short periods the gain over the period is that of Kalman and Bucy, with an error that falls as the
// period.
TEST(LoadObserver, TendsToTheContinuousFilter) {
  for (const Case& c : vectors()) {
    const auto error = [&](double period_s) {
      const Eigen::Vector3d gain = LoadObserver({c.motor, c.noise, period_s, 1}).gain() / period_s;
      return (gain - c.gain).cwiseQuotient(c.gain).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(error(2e-5), 0.03);
    EXPECT_NEAR(error(2e-5) / error(4e-5), 0.5, 0.02);
  }
}

// Loads that swing come through as load_response says, also where positions are seldom; amplitudes by
// correlation over whole turns.
TEST_P(ObserverRate, BandwidthIsAsStated) {
  const Case c = vectors()[0];
  const LoadObserver observer({c.motor, c.noise, 0.001, GetParam()});
  for (const double hz : {5.0, 20.0, 50.0}) {
    const double omega = 2 * kPi * hz;
    LoadObserver::State state;
    Motor motor{c.motor};
    observer.step(0, 0, state);
    std::complex<double> turned = 0;
    for (int k = 0; k < 3000; ++k) {
      constexpr int kParts = 20;
      for (int i = 0; i < kParts; ++i)
        motor.step(0, std::sin(omega * (k + (i + 0.5) / kParts) * 0.001), 0.001 / kParts);
      observer.step(0, motor.x, state);
      if (k < 2000 || (k + 1) % GetParam() != 0) continue;
      turned += state.estimate[2] * std::polar(1.0, -omega * 0.001 * (k + 1)) * (2.0 * GetParam() / 1000);
    }
    // The load is sin(omega t), the imaginary part of the turning unit.
    const std::complex<double> response = turned * std::complex<double>(0, 1);
    EXPECT_LT(std::abs(response - observer.load_response(omega)), 1e-3) << hz;
  }
}

}  // namespace
}  // namespace trn
