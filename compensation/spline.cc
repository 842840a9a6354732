#include "compensation/spline.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/check.h"
#include "core/solve_in_place.h"

namespace trn {

Spline::Spline(std::vector<double> x, std::vector<double> y)
    : x_(std::move(x)), y_(std::move(y)), m_(x_.size(), 0.0) {
  const std::size_t n = x_.size();
  if (y_.size() != n) throw std::invalid_argument("a table needs as many values as places");
  for (std::size_t i = 1; i < n; ++i)
    if (!(x_[i] > x_[i - 1])) throw std::invalid_argument("the places of a table must rise");
  // Two points make a straight line, whose second derivatives are zero.
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

Spline Spline::periodic(std::vector<double> x, std::vector<double> y) {
  Spline out(std::move(x), std::move(y));
  const std::size_t n = out.x_.size();
  // The values must agree to the last bit: the tables come from a config, where equal numbers are written
  // alike, and a gap of a rounding error would still be a step in the axis once a turn.
  if (n < 4 || out.y_.front() != out.y_.back())
    throw std::invalid_argument(
        "a periodic table has at least four places, and ends with the value it begins with");
  out.period_ = out.x_.back() - out.x_.front();
  // The first point stands for the last as well. The same equations as above, but each end has the other as
  // its neighbour, so the matrix has two corners beside its three diagonals. It is solved once, when the
  // config is read.
  const auto k = static_cast<Eigen::Index>(n - 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd b(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const auto at = static_cast<std::size_t>(i), before = at == 0 ? n - 2 : at - 1;
    const double h0 = out.x_[before + 1] - out.x_[before], h1 = out.x_[at + 1] - out.x_[at];
    A(i, (i + k - 1) % k) += h0;
    A(i, i) += 2 * (h0 + h1);
    A(i, (i + 1) % k) += h1;
    b[i] = 6 * ((out.y_[at + 1] - out.y_[at]) / h1 - (out.y_[before + 1] - out.y_[before]) / h0);
  }
  solve_in_place(A, b);
  for (std::size_t i = 0; i < n; ++i) out.m_[i] = b[static_cast<Eigen::Index>(i) % k];
  return out;
}

double Spline::placed(double x) const TRN_RT {
  // The turn in which the axis stands does not matter: at 725 degrees it has the errors of 5.
  if (period_ > 0) x -= period_ * std::floor((x - x_.front()) / period_);
  return std::clamp(x, x_.front(), x_.back());
}

std::size_t Spline::cell(double x) const TRN_RT {
  const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, x);
  TRN_CHECK(above > x_.begin() && above < x_.end());
  return static_cast<std::size_t>(above - x_.begin()) - 1;
}

double Spline::at(double x) const TRN_RT {
  if (x_.size() < 2) return x_.empty() ? 0.0 : y_[0];
  TRN_CHECK(std::isfinite(x));
  const double inside = placed(x);
  const std::size_t i = cell(inside);
  const double h = x_[i + 1] - x_[i], b = (inside - x_[i]) / h, a = 1 - b;
  const double y =
      a * y_[i] + b * y_[i + 1] + h * h / 6 * (a * (a * a - 1) * m_[i] + b * (b * b - 1) * m_[i + 1]);
  // A straight line goes on beyond the table with the slope of its end. A constant would leave a kink there,
  // which the planner would have to slow down for.
  return y + (x == inside || period_ > 0 ? 0.0 : (x - inside) * slope(inside));
}

double Spline::slope(double x) const TRN_RT {
  if (x_.size() < 2) return 0;
  const double inside = placed(x);
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
  // Between two points the slope is a parabola, so its greatest value may lie inside. Nine places of each
  // cell find it closely enough to refuse a table that is too steep.
  constexpr int kParts = 8;
  double peak = 0;
  for (std::size_t i = 0; i + 1 < x_.size(); ++i)
    for (int k = 0; k <= kParts; ++k)
      peak = std::max(peak, std::abs(slope(x_[i] + (x_[i + 1] - x_[i]) * k / kParts)));
  return peak;
}

}  // namespace trn
