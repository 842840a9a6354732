#include <fmt/format.h>

#include <cmath>

#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"

// Splines in the XY plane: G5 (cubic), G5.1 (quadratic), G5.2/G5.3 (NURBS).
namespace trn {

namespace {

Vec3 lift(double x, double y) { return {x, y, 0}; }

// Degree elevation: the quadratic with control point q as a cubic.
std::array<Vec3, 4> cubic_from_quadratic(const Vec3& a, const Vec3& q, const Vec3& d) {
  return {a, a + (q - a) * (2.0 / 3.0), d + (q - d) * (2.0 / 3.0), d};
}

/// Point of a NURBS curve of order `k` with clamped uniform knots at parameter u in [0, n - k + 1].
template <typename Points>
Vec3 nurbs_point(const Points& points, int k, double u) {
  const int n = static_cast<int>(points.size()) - 1;
  const auto knot = [&](int i) { return i < k ? 0.0 : i > n ? double(n - k + 2) : double(i - k + 1); };
  std::vector<double> basis(points.size() + static_cast<std::size_t>(k), 0.0);
  int span = k - 1;
  while (span < n && u >= knot(span + 1)) ++span;
  basis[static_cast<std::size_t>(span)] = 1;
  for (int degree = 1; degree < k; ++degree)
    for (int i = 0; i <= n; ++i) {
      const double left = knot(i + degree) - knot(i), right = knot(i + degree + 1) - knot(i + 1);
      const double first = left > 0 ? (u - knot(i)) / left * basis[static_cast<std::size_t>(i)] : 0;
      const double second =
          right > 0 ? (knot(i + degree + 1) - u) / right * basis[static_cast<std::size_t>(i) + 1] : 0;
      basis[static_cast<std::size_t>(i)] = first + second;
    }
  double x = 0, y = 0, weight = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = basis[i] * points[i].weight;
    x += w * points[i].x;
    y += w * points[i].y;
    weight += w;
  }
  return lift(x / weight, y / weight);
}

}  // namespace

void Executor::spline(const Block& b, int motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  if (left_contour_)
    fail(GcodeErrorCode::kCompCorner, column, "the first move after G40 is a spline", "a straight move");
  if (s_.modal.plane != Plane::kXY)
    fail(GcodeErrorCode::kPlane, column, g_name(motion), s_.modal.plane == Plane::kXZ ? "G18" : "G19", "G17");
  if (motion == 51 && b.has('Q') && !b.has_axis_word() && !b.has('I')) return ignore_smoothing(column);
  if (motion != 53) check_feed(b, g_name(motion));
  for (const char letter : {'Z', 'A', 'B', 'C'})
    if (b.has(letter)) fail(GcodeErrorCode::kSpline, b.at(letter), "a spline stays in XY", "X and Y");
  if (motion == 50) return cubic_spline(b);
  if (motion == 51) return quadratic_spline(b);
  nurbs(b, motion);
}

void Executor::ignore_smoothing(std::uint32_t column) {
  if (!warned_smoothing_)
    parts_.warn(column, "G5.1 Q, the smoothing of other controls, is ignored; G64 P sets tolerances");
  warned_smoothing_ = true;
}

void Executor::cubic_spline(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (!b.has('P') || !b.has('Q')) fail(GcodeErrorCode::kMissingWord, column, "G5", "P and Q words");
  if (b.has('I') != b.has('J')) fail(GcodeErrorCode::kMissingWord, column, "G5", "both I and J, or neither");
  if (!b.has('I') && !spline_chained_)
    fail(GcodeErrorCode::kMissingWord, column, "the first G5", "I and J words");
  const AxisValues to = target(b);
  const double i = b.has('I') ? b['I'] : -spline_tangent_[kX];
  const double j = b.has('I') ? b['J'] : -spline_tangent_[kY];
  auto hull = std::make_shared<std::vector<Vec3>>();
  *hull = {lift(s_.position[kX], s_.position[kY]), lift(s_.position[kX] + i, s_.position[kY] + j),
           lift(to[kX] + b['P'], to[kY] + b['Q']), lift(to[kX], to[kY])};
  put(canon::NurbsFeed{4, to, hull});
  spline_tangent_[kX] = b['P'];
  spline_tangent_[kY] = b['Q'];
  spline_chained_ = true;
  s_.position = to;
}

void Executor::quadratic_spline(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (!b.has('I') && !b.has('J')) fail(GcodeErrorCode::kMissingWord, column, "G5.1", "an I or a J word");
  const AxisValues to = target(b);
  const Vec3 from = lift(s_.position[kX], s_.position[kY]), end = lift(to[kX], to[kY]);
  const auto cubic = cubic_from_quadratic(from, from + lift(b.get('I', 0), b.get('J', 0)), end);
  put(canon::NurbsFeed{3, to, std::make_shared<std::vector<Vec3>>(cubic.begin(), cubic.end())});
  s_.position = to;
}

// G5.2 collects control points (X Y, weight P, order L), G5.3 runs the curve: as cubic pieces through points
// and tangents of the curve, fine enough to stay within a micrometre.
void Executor::nurbs(const Block& b, int motion) {
  const std::uint32_t column = b.at(GGroup::kMotion);
  if (motion == 52) {
    if (!in_nurbs_) {
      nurbs_.assign(1, {s_.position[kX], s_.position[kY], b.get('P', 1)});
      nurbs_order_ = b.get('L', 3);
      in_nurbs_ = true;
    }
    if (b.has_axis_word()) {
      const AxisValues to = target(b);
      nurbs_.push_back({to[kX], to[kY], b.get('P', 1)});
    }
    if (b.get('P', 1) <= 0)
      fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], "G5.2", "a weight above 0");
    return;
  }
  if (!in_nurbs_) fail(GcodeErrorCode::kSpline, column, "G5.3 without G5.2", "G5.2 first");
  in_nurbs_ = false;
  const int order = static_cast<int>(nurbs_order_);
  if (order < 2 || order != nurbs_order_ || nurbs_.size() < static_cast<std::size_t>(order))
    fail(GcodeErrorCode::kSpline, column, "G5.2 has too few control points for its order L",
         "at least as many control points as the order");
  const double last = static_cast<double>(nurbs_.size()) - order + 1;
  const int pieces = 16 * static_cast<int>(nurbs_.size());
  auto hull = std::make_shared<std::vector<Vec3>>();
  const auto at = [&](double u) { return nurbs_point(nurbs_, order, std::clamp(u, 0.0, last)); };
  for (int i = 0; i < pieces; ++i) {
    const double u0 = last * i / pieces, h = last / pieces, u1 = u0 + h;
    const Vec3 p0 = at(u0), p1 = at(u1), pa = at(u0 + h / 3), pb = at(u0 + 2 * h / 3);
    // the cubic through four points of the curve
    hull->insert(hull->end(), {p0, (-5 * p0 + 18 * pa - 9 * pb + 2 * p1) / 6,
                               (2 * p0 - 9 * pa + 18 * pb - 5 * p1) / 6, p1});
  }
  AxisValues to = s_.position;
  to[kX] = nurbs_.back().x;
  to[kY] = nurbs_.back().y;
  put(canon::NurbsFeed{static_cast<int>(nurbs_.size()), to, hull});
  s_.position = to;
}

}  // namespace trn
