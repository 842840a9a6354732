#include "interp/plan/geometry/quintic_spline.h"

#include <algorithm>

namespace trn {

namespace {

// Smoothing length as a part of the span: damps what the samples' rounding would excite near the spline's own
// resolution and carries spans that hold no sample.
constexpr double kRho = 0.3;

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

// Symmetric banded normal equations: band[i][k] = A(i, i + k).
struct Normal {
  std::vector<Row> band;
  std::vector<Words> rhs;

  explicit Normal(size_t n) : band(n, Row{}), rhs(n, Words::Zero()) {}

  void add(size_t first, const Row& row, double weight) {
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = i; j < 6; ++j) band[first + i][j - i] += weight * row[i] * row[j];
  }
};

void add_penalty(Normal& normal, const QuinticSpline& spline) {
  constexpr double kNode[3] = {-0.7745966692414834, 0, 0.7745966692414834};  // Gauss, exact for y'''^2
  constexpr double kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (size_t k = 0; k + 11 < spline.knots.size(); ++k) {
    const double* t = spline.knots.data() + k;
    const double h = t[6] - t[5], rh = kRho * h;
    const double lambda = rh * rh * rh * rh * rh * rh * h;
    for (int g = 0; g < 3; ++g) {
      const double u = t[5] + h * (0.5 + 0.5 * kNode[g]);
      normal.add(k, third_derivative_row(t, basis(t + 5, u)), lambda * kWeight[g]);
    }
  }
}

void add_samples(Normal& normal, const QuinticSpline& spline, const std::vector<SplineSample>& samples) {
  size_t k = 0;
  const size_t spans = spline.knots.size() - 11;
  for (const SplineSample& sample : samples) {
    while (k + 1 < spans && sample.u >= spline.knots[k + 6]) ++k;
    const Row row = basis(spline.knots.data() + k + 5, sample.u)[5];
    normal.add(k, row, sample.weight);
    for (size_t i = 0; i < 6; ++i) normal.rhs[k + i] += sample.weight * row[i] * sample.y;
  }
}

// L D L' in the band, rows [from, to).
void solve(Normal& normal, size_t from, size_t to) {
  auto& a = normal.band;
  auto& b = normal.rhs;
  for (size_t i = from; i < to; ++i) {
    const double inverse = 1 / a[i][0];
    for (size_t k = 1; k < 6 && i + k < to; ++k) {
      const double f = a[i][k] * inverse;
      for (size_t j = k; j < 6; ++j) a[i + k][j - k] -= f * a[i][j];
      b[i + k] -= f * b[i];
    }
  }
  for (size_t i = to; i-- > from;) {
    for (size_t k = 1; k < 6 && i + k < to; ++k) b[i] -= a[i][k] * b[i + k];
    b[i] /= a[i][0];
  }
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

void fit_coefficients(QuinticSpline& spline, const std::vector<SplineSample>& samples, int fixed_head,
                      int fixed_tail) {
  const size_t n = spline.coefficients.size();
  const size_t from = static_cast<size_t>(fixed_head), to = n - static_cast<size_t>(fixed_tail);
  if (from >= to) return;
  Normal normal(n);
  add_samples(normal, spline, samples);
  add_penalty(normal, spline);
  for (size_t i = 0; i < from; ++i)  // what is fixed moves to the right-hand side
    for (size_t k = 1; k < 6 && i + k < n; ++k)
      normal.rhs[i + k] -= normal.band[i][k] * spline.coefficients[i];
  for (size_t j = to; j < n; ++j)
    for (size_t k = 1; k < 6 && k <= j; ++k)
      normal.rhs[j - k] -= normal.band[j - k][k] * spline.coefficients[j];
  solve(normal, from, to);
  std::copy(normal.rhs.begin() + from, normal.rhs.begin() + to, spline.coefficients.begin() + from);
}

}  // namespace trn
