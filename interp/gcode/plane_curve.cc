#include "interp/gcode/plane_curve.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/units.h"

namespace trn {

namespace {

using Point = PlaneCurve::Point;

constexpr double kTiny = 1e-9;
constexpr double kRounding = 1e-12;  // of a radius

double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

// True if the ray from the arc's centre to p meets the arc.
bool faces(const PlaneCurve& arc, const Point& p) {
  if ((p - arc.centre).norm() < kTiny) return true;
  const double whole = sweep_of(arc.centre, arc.from, arc.to, arc.turn);
  const double part = sweep_of(arc.centre, arc.from, p, arc.turn);
  return part <= whole || part >= 2 * kPi - kTiny;
}

double to_line(const Point& p, const PlaneCurve& line) {
  const Point d = line.to - line.from;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - line.from).dot(d) / length2, 0.0, 1.0) : 0;
  return (p - line.from - t * d).norm();
}

double to_arc(const Point& p, const PlaneCurve& arc) {
  if (faces(arc, p)) return std::abs((p - arc.centre).norm() - arc.radius());
  return std::min((p - arc.from).norm(), (p - arc.to).norm());
}

bool lines_cross(const PlaneCurve& one, const PlaneCurve& two) {
  const Point d1 = one.to - one.from, d2 = two.to - two.from;
  return cross(d1, two.from - one.from) * cross(d1, two.to - one.from) < 0 &&
         cross(d2, one.from - two.from) * cross(d2, one.to - two.from) < 0;
}

// Ends apart, the line is nearest to the arc, or meets it, on the normal through the arc's centre or where it
// crosses the circle.
double line_to_arc(const PlaneCurve& line, const PlaneCurve& arc) {
  const Point d = line.to - line.from;
  const double length = d.norm();
  if (length < kTiny) return to_arc(line.from, arc);
  const Point u = d / length;
  const double along = u.dot(arc.centre - line.from);
  const Point foot = line.from + along * u;
  const double r = arc.radius(), gap = (foot - arc.centre).norm();
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](double t) {
    if (t >= 0 && t <= length) least = std::min(least, to_arc(line.from + t * u, arc));
  };
  look(along);
  const double half2 = r * r - gap * gap;
  if (half2 < 0) return least;
  const double half = std::sqrt(half2);
  look(along - half);
  look(along + half);
  return least;
}

// Ends apart, two arcs are nearest to each other on the line through both centres, or they cross.
double arc_to_arc(const PlaneCurve& one, const PlaneCurve& two) {
  const Point d = two.centre - one.centre;
  const double gap = d.norm(), r1 = one.radius(), r2 = two.radius();
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](const Point& p) {
    if (faces(one, p)) least = std::min(least, to_arc(p, two));
  };
  if (gap < kRounding * (r1 + r2)) return least;  // concentric: the ends tell, but for full turns
  const Point u = d / gap, n(-u.y(), u.x());
  look(one.centre + r1 * u);
  look(one.centre - r1 * u);
  const double along = (r1 * r1 - r2 * r2 + gap * gap) / (2 * gap), half2 = r1 * r1 - along * along;
  if (half2 < 0) return least;
  const double half = std::sqrt(half2);
  look(one.centre + along * u + half * n);
  look(one.centre + along * u - half * n);
  return least;
}

}  // namespace

double sweep_of(const Point& centre, const Point& from, const Point& to, int turn) {
  const Point a = from - centre, b = to - centre;
  double angle = turn * std::atan2(cross(a, b), a.dot(b));
  if (angle <= kTiny) angle += 2 * kPi;
  return angle;
}

double distance(const Point& p, const PlaneCurve& curve) {
  return curve.turn == 0 ? to_line(p, curve) : to_arc(p, curve);
}

double distance(const PlaneCurve& one, const PlaneCurve& two) {
  const double ends = std::min(
      {distance(one.from, two), distance(one.to, two), distance(two.from, one), distance(two.to, one)});
  if (one.turn == 0 && two.turn == 0) return lines_cross(one, two) ? 0 : ends;
  if (one.turn == 0) return std::min(ends, line_to_arc(one, two));
  if (two.turn == 0) return std::min(ends, line_to_arc(two, one));
  return std::min(ends, arc_to_arc(one, two));
}

PlaneBox box_of(const PlaneCurve& curve) {
  PlaneBox box(curve.from.cwiseMin(curve.to), curve.from.cwiseMax(curve.to));
  if (curve.turn == 0) return box;
  const double r = curve.radius();
  for (const Point& way : {Point(1, 0), Point(0, 1), Point(-1, 0), Point(0, -1)})
    if (faces(curve, curve.centre + way)) box.extend(Point(curve.centre + r * way));
  return box;
}

}  // namespace trn
