#include "interp/gcode/executor/nurbs.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

namespace {
constexpr int kPiecesPerSpan = 16;
}

Vec3 NurbsCurve::at(double u) const {
  TRN_CHECK(order >= 1 && points.size() >= static_cast<std::size_t>(order));
  TRN_CHECK(knots.size() >= points.size() + static_cast<std::size_t>(order));
  const auto p = static_cast<std::size_t>(order) - 1;
  std::size_t span = p;
  // The last span with u inside. At the very end of the curve u lies behind all of them, and the last span is
  // taken.
  while (span + 1 < points.size() && u >= knots[span + 1]) ++span;
  TRN_CHECK(span < points.size() && span >= p);
  std::vector<Eigen::Vector4d> d;
  for (std::size_t i = span - p; i <= span; ++i) {
    // A rational curve is a plain B-spline of (w x, w y, w z, w), divided by its weight at the end.
    Eigen::Vector4d weighted = points[i] * points[i][3];
    weighted[3] = points[i][3];
    d.push_back(weighted);
  }
  for (std::size_t r = 1; r <= p; ++r)
    for (std::size_t j = p; j >= r; --j) {
      const std::size_t i = span - p + j;
      // De Boor's algorithm. Knots that coincide have no width; their share then does not matter.
      const double width = knots[i + p + 1 - r] - knots[i];
      const double share = width > 0 ? (u - knots[i]) / width : 0;
      d[j] = (1 - share) * d[j - 1] + share * d[j];
    }
  return d[p].head<3>() / d[p][3];
}

std::vector<double> clamped_uniform_knots(std::size_t points, int order) {
  TRN_CHECK(order >= 1 && points >= static_cast<std::size_t>(order));
  std::vector<double> knots;
  const int last = static_cast<int>(points) - order + 1;
  // As many equal knots at each end as the order: the curve begins in its first control point and ends in its
  // last.
  for (int i = 0; i < static_cast<int>(points) + order; ++i)
    knots.push_back(std::clamp(i - order + 1, 0, last));
  return knots;
}

std::vector<Vec3> cubic_hulls(const NurbsCurve& curve) {
  TRN_CHECK(curve.order >= 1 && curve.knots.size() > curve.points.size());
  std::vector<Vec3> hulls;
  for (std::size_t k = static_cast<std::size_t>(curve.order) - 1; k < curve.points.size(); ++k) {
    const double from = curve.knots[k], h = (curve.knots[k + 1] - from) / kPiecesPerSpan;
    // A span between equal knots has no curve.
    if (h <= 0) continue;
    for (int i = 0; i < kPiecesPerSpan; ++i) {
      const double u = from + h * i;
      const Vec3 p0 = curve.at(u), pa = curve.at(u + h / 3), pb = curve.at(u + 2 * h / 3);
      const Vec3 p1 = curve.at(std::min(u + h, curve.last()));
      hulls.push_back(p0);
      // The control points of the cubic that runs through the curve at 0, 1/3, 2/3 and 1 of the piece.
      hulls.push_back((-5 * p0 + 18 * pa - 9 * pb + 2 * p1) / 6);
      hulls.push_back((2 * p0 - 9 * pa + 18 * pb - 5 * p1) / 6);
      hulls.push_back(p1);
    }
  }
  return hulls;
}

}  // namespace trn
