#include "compensation/spline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace trn {

Spline::Spline(std::vector<double> x, std::vector<double> y)
    : x_(std::move(x)), y_(std::move(y)), m_(x_.size(), 0.0) {
  const std::size_t n = x_.size();
  if (y_.size() != n) throw std::invalid_argument("a table needs as many values as places");
  for (std::size_t i = 1; i < n; ++i)
    if (!(x_[i] > x_[i - 1])) throw std::invalid_argument("the places of a table must rise");
  if (n < 3) return;
  // Thomas' algorithm for the second derivatives, zero at both ends.
  std::vector<double> upper(n, 0.0), right(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = x_[i] - x_[i - 1], h1 = x_[i + 1] - x_[i];
    const double pivot = 2 * (h0 + h1) - h0 * upper[i - 1];
    upper[i] = h1 / pivot;
    right[i] = (6 * ((y_[i + 1] - y_[i]) / h1 - (y_[i] - y_[i - 1]) / h0) - h0 * right[i - 1]) / pivot;
  }
  for (std::size_t i = n - 2; i > 0; --i) m_[i] = right[i] - upper[i] * m_[i + 1];
}

std::size_t Spline::cell(double x) const TRN_RT {
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  return static_cast<std::size_t>(above - x_.begin()) - 1;
}

double Spline::at(double x) const TRN_RT {
  if (x_.size() < 2) return x_.empty() ? 0.0 : y_[0];
  const double inside = std::clamp(x, x_.front(), x_.back());
  const std::size_t i = cell(inside);
  const double h = x_[i + 1] - x_[i], b = (inside - x_[i]) / h, a = 1 - b;
  const double y =
      a * y_[i] + b * y_[i + 1] + h * h / 6 * (a * (a * a - 1) * m_[i] + b * (b * b - 1) * m_[i + 1]);
  return y + (x == inside ? 0.0 : (x - inside) * slope(inside));
}

double Spline::slope(double x) const TRN_RT {
  if (x_.size() < 2) return 0;
  const double inside = std::clamp(x, x_.front(), x_.back());
  const std::size_t i = cell(inside);
  const double h = x_[i + 1] - x_[i], b = (inside - x_[i]) / h, a = 1 - b;
  return (y_[i + 1] - y_[i]) / h + h / 6 * ((3 * b * b - 1) * m_[i + 1] - (3 * a * a - 1) * m_[i]);
}

double Spline::peak() const {
  double peak = 0;
  for (const double y : y_) peak = std::max(peak, std::abs(y));
  return peak;
}

double Spline::slope_max() const {
  constexpr int kParts = 8;
  double peak = 0;
  for (std::size_t i = 0; i + 1 < x_.size(); ++i)
    for (int k = 0; k <= kParts; ++k)
      peak = std::max(peak, std::abs(slope(x_[i] + (x_[i + 1] - x_[i]) * k / kParts)));
  return peak;
}

}  // namespace trn
