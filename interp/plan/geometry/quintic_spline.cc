#include "interp/plan/geometry/quintic_spline.h"

#include <algorithm>

namespace trn {

namespace {

using Row = std::array<double, 6>;
using BasisTable = std::array<Row, 6>;  // [degree][function]

// All B-spline functions of degree 0 .. 5 that live on the span, at u (Cox - de Boor).
BasisTable basis(const double* span_start, double u) {
  BasisTable n{};
  n[0][0] = 1;
  for (int p = 1; p <= 5; ++p) {
    double saved = 0;
    for (int r = 0; r < p; ++r) {
      const double right = span_start[r + 1], left = span_start[r + 1 - p];
      const double part = n[p - 1][r] / (right - left);
      n[p][r] = saved + (right - u) * part;
      saved = (u - left) * part;
    }
    n[p][p] = saved;
  }
  return n;
}

// Third derivative at u as a row over the six coefficients of the span.
Row third_derivative_row(const double* t, const BasisTable& n) {  // t: knot k of span k
  double m[6][6] = {};
  for (int i = 0; i < 6; ++i) m[i][i] = 1;
  for (int order = 1; order <= 3; ++order)
    for (int i = 0; i < 6 - order; ++i) {
      const double scale = (6 - order) / (t[i + 6] - t[i + order]);
      for (int j = 0; j < 6; ++j) m[i][j] = (m[i + 1][j] - m[i][j]) * scale;
    }
  Row row{};
  for (int j = 0; j < 6; ++j)
    row[static_cast<size_t>(j)] = n[2][0] * m[0][j] + n[2][1] * m[1][j] + n[2][2] * m[2][j];
  return row;
}

}  // namespace

PathPoint QuinticSpline::derivatives_at_break(int i) const {
  const int k = std::min(i, span_count() - 1);
  const double* t = knots.data() + k;
  const BasisTable n = basis(t + 5, knots[static_cast<size_t>(5 + i)]);
  std::array<Words, 6> d;
  for (size_t j = 0; j < 6; ++j) d[j] = coefficients[static_cast<size_t>(k) + j];
  std::array<Words, 4> out;
  for (int order = 0; order <= 3; ++order) {
    if (order > 0)
      for (int j = 0; j < 6 - order; ++j)
        d[j] = (d[static_cast<size_t>(j + 1)] - d[static_cast<size_t>(j)]) *
               ((6 - order) / (t[j + 6] - t[j + order]));
    out[order].setZero();
    for (int j = 0; j < 6 - order; ++j) out[order] += n[5 - order][j] * d[j];
  }
  return {out[0], out[1], out[2], out[3]};
}

void locate_samples(const QuinticSpline& spline, std::vector<SplineSample>& samples) {
  size_t k = 0;
  const size_t spans = static_cast<size_t>(spline.span_count());
  for (SplineSample& sample : samples) {
    while (k + 1 < spans && sample.u >= spline.knots[k + 6]) ++k;
    sample.span = k;
    sample.row = basis(spline.knots.data() + k + 5, sample.u)[5];
  }
}

Words value_at(const QuinticSpline& spline, const SplineSample& sample) {
  Words y = Words::Zero();
  for (size_t i = 0; i < 6; ++i) y += sample.row[i] * spline.coefficients[sample.span + i];
  return y;
}

SplineProblem::SplineProblem(const QuinticSpline& spline, const std::vector<SplineSample>& samples,
                             double smoothing, int fixed_head, int fixed_tail)
    : from_(static_cast<size_t>(fixed_head)),
      to_(spline.coefficients.size() - static_cast<size_t>(fixed_tail)),
      band_(spline.coefficients.size(), Row{}),
      inverse_(spline.coefficients.size(), 0.0),
      fixed_rhs_(spline.coefficients.size(), Words::Zero()),
      rhs_(spline.coefficients.size(), Words::Zero()) {
  for (const SplineSample& sample : samples) add(sample.span, sample.row, sample.weight);
  add_penalty(spline, smoothing);
  move_fixed_to_rhs(spline);
  factorise();
}

void SplineProblem::add(size_t first, const Row& row, double weight) {
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = i; j < 6; ++j) band_[first + i][j - i] += weight * row[i] * row[j];
}

void SplineProblem::add_penalty(const QuinticSpline& spline, double smoothing) {
  constexpr double kNode[3] = {-0.7745966692414834, 0, 0.7745966692414834};  // Gauss, exact for y'''^2
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  const size_t spans = spline.knots.size() - 11;
  for (size_t k = from_ - std::min<size_t>(from_, 5); k < std::min(to_, spans); ++k) {
    const double* t = spline.knots.data() + k;
    const double h = t[6] - t[5], r3 = smoothing * smoothing * smoothing * h * h * h;
    for (int g = 0; g < 3; ++g) {
      const double u = t[5] + h * (0.5 + 0.5 * kNode[g]);
      add(k, third_derivative_row(t, basis(t + 5, u)), r3 * r3 * h * kWeight[g]);
    }
  }
}

void SplineProblem::move_fixed_to_rhs(const QuinticSpline& spline) {
  const size_t n = band_.size();
  for (size_t i = from_ - std::min<size_t>(from_, 5); i < from_; ++i)
    for (size_t k = 1; k < 6 && i + k < n; ++k) fixed_rhs_[i + k] -= band_[i][k] * spline.coefficients[i];
  for (size_t j = to_; j < std::min(n, to_ + 5); ++j)
    for (size_t k = 1; k < 6 && k <= j; ++k) fixed_rhs_[j - k] -= band_[j - k][k] * spline.coefficients[j];
}

// L D L': afterwards band_[i][k], k > 0, is L(i + k, i).
void SplineProblem::factorise() {
  for (size_t i = from_; i < to_; ++i) {
    inverse_[i] = 1 / band_[i][0];
    Row scaled{};
    for (size_t k = 1; k < 6 && i + k < to_; ++k) scaled[k] = band_[i][k] * inverse_[i];
    for (size_t k = 1; k < 6 && i + k < to_; ++k)
      for (size_t j = k; j < 6; ++j) band_[i + k][j - k] -= scaled[k] * band_[i][j];
    for (size_t k = 1; k < 6; ++k) band_[i][k] = scaled[k];
  }
}

void SplineProblem::solve(const std::vector<SplineSample>& samples, QuinticSpline& spline) {
  const auto from = static_cast<std::ptrdiff_t>(from_), to = static_cast<std::ptrdiff_t>(to_);
  std::copy(fixed_rhs_.begin() + from, fixed_rhs_.begin() + to, rhs_.begin() + from);
  for (const SplineSample& sample : samples)
    for (size_t i = 0; i < 6; ++i) rhs_[sample.span + i] += (sample.weight * sample.row[i]) * sample.y;
  for (size_t i = from_; i < to_; ++i)
    for (size_t k = 1; k < 6 && i + k < to_; ++k) rhs_[i + k] -= band_[i][k] * rhs_[i];
  for (size_t i = to_; i-- > from_;) {
    Words& y = spline.coefficients[i];
    y = rhs_[i] * inverse_[i];
    for (size_t k = 1; k < 6 && i + k < to_; ++k) y -= band_[i][k] * spline.coefficients[i + k];
  }
}

}  // namespace trn
