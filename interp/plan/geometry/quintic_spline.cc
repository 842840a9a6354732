#include "interp/plan/geometry/quintic_spline.h"

#include <algorithm>

#include "core/check.h"

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

}  // namespace

PathPoint QuinticSpline::derivatives_at_break(int i) const {
  TRN_CHECK(i >= 0 && i <= span_count());
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

Row basis_row(const QuinticSpline& spline, size_t span, double u) {
  return basis(spline.knots.data() + span + 5, u)[5];
}

}  // namespace trn
