#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace trn::test {

/// The truth: the heat equation on a finer grid, solved implicitly, with its own numbers.
class TrueScrew {
 public:
  TrueScrew(double length_mm, double friction_N, double bearing_N, double cooling)
      : n_(241),
        dx_(length_mm / 1000 / 240),
        friction_(friction_N),
        bearing_(bearing_N),
        cooling_(cooling),
        T_(n_, 0.0),
        source_(n_, 0.0),
        sum_(n_, 0.0) {}
  void move(double x_mm, double way_mm) {
    const double node = std::clamp(x_mm / 1000 / dx_, 0.0, static_cast<double>(n_ - 1));
    source_[static_cast<std::size_t>(std::lround(node))] += friction_ * way_mm / 1000;
    source_.front() += bearing_ * way_mm / 1000;
    source_.back() += bearing_ * way_mm / 1000;
  }
  void step(double dt) {
    const double area = M_PI * 0.02 * 0.02, rho_c = 7850.0 * 460, k = 45;
    const double lambda = k / rho_c * dt / (dx_ * dx_), loss = cooling_ * M_PI * 0.04 / (rho_c * area) * dt;
    std::vector<double> a(n_), b(n_), c(n_), d(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      const double share = i == 0 || i + 1 == n_ ? 0.5 : 1;
      a[i] = i > 0 ? -lambda / share : 0;
      c[i] = i + 1 < n_ ? -lambda / share : 0;
      b[i] = 1 + loss - a[i] - c[i];
      d[i] = T_[i] + source_[i] / (rho_c * area * dx_ * share);
    }
    for (std::size_t i = 1; i < n_; ++i) {
      const double w = a[i] / b[i - 1];
      b[i] -= w * c[i - 1];
      d[i] -= w * d[i - 1];
    }
    T_[n_ - 1] = d[n_ - 1] / b[n_ - 1];
    for (std::size_t i = n_ - 1; i-- > 0;) T_[i] = (d[i] - c[i] * T_[i + 1]) / b[i];
    std::fill(source_.begin(), source_.end(), 0.0);
    for (std::size_t i = 1; i < n_; ++i) sum_[i] = sum_[i - 1] + 500 * dx_ * (T_[i] + T_[i - 1]);
  }
  double rise_at(double x_mm) const {
    const double node = std::clamp(x_mm / 1000 / dx_, 0.0, static_cast<double>(n_) - 1.001);
    const auto i = static_cast<std::size_t>(node);
    return T_[i] + (node - static_cast<double>(i)) * (T_[i + 1] - T_[i]);
  }
  /// Fixed-free: everything between the fixed bearing and the nut has grown.
  double displacement(double x_mm, double alpha = 11.7e-6) const {
    const double node = std::clamp(x_mm / 1000 / dx_, 0.0, static_cast<double>(n_) - 1.001);
    const auto i = static_cast<std::size_t>(node);
    const double way_mm = x_mm - 1000 * dx_ * static_cast<double>(i);
    return alpha * (sum_[i] + way_mm * (T_[i] + rise_at(x_mm)) / 2);
  }

 private:
  std::size_t n_;
  double dx_, friction_, bearing_, cooling_;
  std::vector<double> T_, source_, sum_;  ///< K; J; integral of the rise from the fixed bearing on, K mm
};

}  // namespace trn::test
