#include "compensation/fit/joint_table_fit.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compensation/fit/least_squares.h"
#include "core/solve_in_place.h"

namespace trn {

namespace {

std::vector<int> directions_of(const std::vector<AxisMeasurement>& m) {
  std::vector<int> out(m.size(), 0);
  for (std::size_t i = 1; i < m.size(); ++i) {
    const double step = m[i].commanded - m[i - 1].commanded;
    out[i] = step == 0 ? out[i - 1] : (step > 0 ? 1 : -1);  // repeated at the same place: as before
  }
  if (m.size() > 1) out[0] = out[1];  // approached in the direction in which it goes on
  return out;
}

void fit_line(const std::vector<AxisMeasurement>& m, bool both, JointTableFit& fit) {
  const auto n = static_cast<Eigen::Index>(m.size());
  const Eigen::Index columns = both ? 3 : 2;
  Eigen::MatrixXd A(n, columns);
  Eigen::VectorXd e(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AxisMeasurement& point = m[static_cast<std::size_t>(i)];
    A(i, 0) = 1;
    A(i, 1) = point.commanded;
    // Driven forward the axis lags by half of the backlash, driven backward it leads by the other half. With
    // one direction only, this column would be that of the datum.
    if (both) A(i, 2) = -fit.direction[static_cast<std::size_t>(i)] / 2.0;
    e[i] = point.actual - point.commanded;
  }
  const LeastSquares equations(A);
  const Eigen::VectorXd x = equations.solve(e);
  const double left = (A * x - e).squaredNorm();
  const Eigen::MatrixXd covariance =
      left / static_cast<double>(std::max<Eigen::Index>(1, n - columns)) * equations.covariance();
  fit.datum = x[0];
  // An axis that goes 1.001 mm for each commanded one must be told 1 / 1.001.
  fit.slope = 1 / (1 + x[1]) - 1;
  fit.slope_deviation = std::sqrt(covariance(1, 1));
  fit.backlash = both ? x[2] : 0;
  fit.backlash_deviation = both ? std::sqrt(covariance(2, 2)) : 0;
  fit.rms = std::sqrt(left / static_cast<double>(n));
}

/// Heights of the hats of a piecewise linear function at `at` that fits the errors of one direction best.
std::vector<double> fit_curve(const std::vector<AxisMeasurement>& m, const JointTableFit& fit,
                              int direction) {
  const auto k = static_cast<Eigen::Index>(fit.at.size());
  const double spacing = fit.at[1] - fit.at[0];
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(k);
  for (std::size_t i = 0; i < m.size(); ++i) {
    if (fit.direction[i] != direction) continue;
    const double cell = std::clamp((m[i].commanded - fit.at[0]) / spacing, 0.0, static_cast<double>(k - 1));
    const auto left =
        static_cast<Eigen::Index>(std::min<double>(std::floor(cell), static_cast<double>(k - 2)));
    const double w = cell - static_cast<double>(left), error = m[i].actual - m[i].commanded - fit.datum;
    const double weights[] = {1 - w, w};
    for (Eigen::Index r = 0; r < 2; ++r) {
      // Each measurement lies between two places of the table and pulls at both of their heights, by the
      // shares with which linear interpolation would use them.
      b[left + r] += weights[r] * error;
      for (Eigen::Index c = 0; c < 2; ++c) N(left + r, left + c) += weights[r] * weights[c];
    }
  }
  // A height that no measurement pulls at could be anything, and the system has no single answer.
  if (N.diagonal().minCoeff() <= 1e-6)
    throw std::invalid_argument("a place of the table has no measurement near it; ask for fewer places");
  solve_in_place(N, b);
  return {b.data(), b.data() + b.size()};
}

}  // namespace

JointTableFit fit_joint_table(const std::vector<AxisMeasurement>& measurements, int places) {
  if (measurements.size() < 4) throw std::invalid_argument("too few measurements: at least four");
  for (const AxisMeasurement& point : measurements)
    if (!std::isfinite(point.commanded) || !std::isfinite(point.actual))
      throw std::invalid_argument("a measurement is not a finite number");
  JointTableFit fit;
  fit.direction = directions_of(measurements);
  const bool there = std::count(fit.direction.begin(), fit.direction.end(), 1) > 1;
  const bool back = std::count(fit.direction.begin(), fit.direction.end(), -1) > 1;
  if (!there && !back) throw std::invalid_argument("the axis was never moved");
  fit_line(measurements, there && back, fit);
  if (places < 2) return fit;
  const auto [low, high] =
      std::minmax_element(measurements.begin(), measurements.end(),
                          [](const auto& a, const auto& b) { return a.commanded < b.commanded; });
  for (int i = 0; i < places; ++i)
    fit.at.push_back(low->commanded + (high->commanded - low->commanded) * i / (places - 1));
  if (there) fit.forward = fit_curve(measurements, fit, 1);
  if (back) fit.backward = fit_curve(measurements, fit, -1);
  // An axis that was measured in one direction only gets the same table for the other: a backlash of zero
  // rather than one of the whole error.
  if (!there) fit.forward = fit.backward;
  if (!back) fit.backward = fit.forward;
  return fit;
}

}  // namespace trn
