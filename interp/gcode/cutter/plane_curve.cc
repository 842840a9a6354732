#include "interp/gcode/cutter/plane_curve.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.h"
#include "core/units.h"

namespace trn {

namespace {

using Point = PlaneCurve::Point;

constexpr double kTinyMm = 1e-9;
constexpr double kRounding = 1e-12;  // of a radius
constexpr double kShortest_rad = 1e-7;

// True if the ray from the arc's centre to p meets the arc.
bool faces(const PlaneCurve& arc, const Point& p) {
  TRN_CHECK(arc.turn != 0);
  // Every point of the arc is as near to the centre as any other.
  if ((p - arc.centre).norm() < kTinyMm) return true;
  const double whole = sweep_of(arc.centre, arc.from, arc.to, arc.turn);
  const double part = sweep_of(arc.centre, arc.from, p, arc.turn);
  return part <= whole || part >= 2 * kPi - kTinyMm;
}

double to_line(const Point& p, const PlaneCurve& line) {
  TRN_CHECK(line.turn == 0);
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
  // Each line has the ends of the other on its two sides.
  return cross(d1, two.from - one.from) * cross(d1, two.to - one.from) < 0 &&
         cross(d2, one.from - two.from) * cross(d2, one.to - two.from) < 0;
}

// Ends apart, the line is nearest to the arc, or meets it, on the normal through the arc's centre or where it
// crosses the circle.
double line_to_arc(const PlaneCurve& line, const PlaneCurve& arc) {
  TRN_CHECK(line.turn == 0 && arc.turn != 0);
  const Point d = line.to - line.from;
  const double length = d.norm();
  if (length < kTinyMm) return to_arc(line.from, arc);
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
  TRN_CHECK(one.turn != 0 && two.turn != 0);
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

// Candidates for points that two curves share: a few points, some of them beyond the curves' ends.
struct FewPoints {
  std::array<Point, 6> at;
  std::size_t count = 0;
  void add(const Point& p) { at[count++] = p; }
};

void cross_lines(const PlaneCurve& one, const PlaneCurve& two, FewPoints& points) {
  const Point d1 = one.to - one.from, d2 = two.to - two.from;
  const double sine = cross(d1, d2);
  if (std::abs(sine) <= kRounding * d1.norm() * d2.norm()) return;
  points.add(one.from + cross(two.from - one.from, d2) / sine * d1);
}

void cross_line_and_circle(const PlaneCurve& line, const PlaneCurve& arc, FewPoints& points) {
  TRN_CHECK(line.turn == 0 && arc.turn != 0);
  const Point d = line.to - line.from;
  if (d.norm() < kTinyMm) return;
  const Point u = d.normalized();
  const Point foot = line.from + u.dot(arc.centre - line.from) * u;
  const double half2 = arc.radius() * arc.radius() - (foot - arc.centre).squaredNorm();
  if (half2 < 0) return;
  points.add(foot - std::sqrt(half2) * u);
  points.add(foot + std::sqrt(half2) * u);
}

void cross_circles(const PlaneCurve& one, const PlaneCurve& two, FewPoints& points) {
  TRN_CHECK(one.turn != 0 && two.turn != 0);
  const Point d = two.centre - one.centre;
  const double gap = d.norm(), r1 = one.radius(), r2 = two.radius();
  if (gap < kRounding * (r1 + r2)) return;
  const Point u = d / gap, n(-u.y(), u.x());
  const double along = (r1 * r1 - r2 * r2 + gap * gap) / (2 * gap), half2 = r1 * r1 - along * along;
  if (half2 < 0) return;
  points.add(one.centre + along * u + std::sqrt(half2) * n);
  points.add(one.centre + along * u - std::sqrt(half2) * n);
}

}  // namespace

double sweep_of(const Point& centre, const Point& from, const Point& to, int turn) {
  TRN_CHECK(turn == 1 || turn == -1);
  const Point a = from - centre, b = to - centre;
  double angle = turn * std::atan2(cross(a, b), a.dot(b));
  // Equal ends are a full turn, as in a program.
  if (angle <= kTinyMm) angle += 2 * kPi;
  return angle;
}

Point centre_between(const Point& from, const Point& to, const Point& given) {
  const Point along = (to - from).normalized();
  return given - along * along.dot(given - (from + to) / 2);
}

double length_of(const PlaneCurve& curve) {
  if (curve.turn == 0) return (curve.to - curve.from).norm();
  return curve.radius() * sweep_of(curve.centre, curve.from, curve.to, curve.turn);
}

double swept_area(const PlaneCurve& curve) {
  // Green's theorem: the area that the spoke from the origin sweeps. Summed over a closed contour it is what
  // the contour encloses, wherever the origin lies. An arc adds the segment between itself and its chord.
  const double triangle = cross(curve.from, curve.to) / 2;
  if (curve.turn == 0) return triangle;
  const double sweep = sweep_of(curve.centre, curve.from, curve.to, curve.turn), r = curve.radius();
  return triangle + curve.turn * r * r * (sweep - std::sin(sweep)) / 2;
}

Point point_at(const PlaneCurve& curve, double fraction) {
  if (fraction <= 0) return curve.from;
  if (fraction >= 1) return curve.to;
  if (curve.turn == 0) return curve.from + fraction * (curve.to - curve.from);
  const double sweep = sweep_of(curve.centre, curve.from, curve.to, curve.turn);
  return curve.centre + Eigen::Rotation2Dd(curve.turn * fraction * sweep) * (curve.from - curve.centre);
}

double fraction_of(const PlaneCurve& curve, const Point& p) {
  const double from_start = (p - curve.from).norm();
  if (from_start < kTinyMm) return 0;
  if (curve.turn == 0) {
    const Point d = curve.to - curve.from;
    return d.squaredNorm() > 0 ? std::clamp((p - curve.from).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
  }
  const double whole = sweep_of(curve.centre, curve.from, curve.to, curve.turn);
  const double part = sweep_of(curve.centre, curve.from, p, curve.turn);
  if (part <= whole) return part / whole;
  return from_start < (p - curve.to).norm() ? 0 : 1;
}

PlaneCurve piece_of(const PlaneCurve& curve, double first, double last) {
  PlaneCurve piece = curve;
  piece.from = point_at(curve, first);
  piece.to = point_at(curve, last);
  // An arc that ends where it starts is a full turn, so that the shortest pieces are straight.
  const double sweep = curve.turn == 0 ? 0 : sweep_of(curve.centre, curve.from, curve.to, curve.turn);
  if ((last - first) * sweep < kShortest_rad) piece.turn = 0;
  return piece;
}

Point direction_of(const PlaneCurve& curve, bool at_end) {
  if (curve.turn == 0) return (curve.to - curve.from).normalized();
  const Point spoke = ((at_end ? curve.to : curve.from) - curve.centre).normalized();
  return curve.turn * Point(-spoke.y(), spoke.x());
}

Meetings meetings(const PlaneCurve& one, const PlaneCurve& two, double touch) {
  FewPoints points;
  // Contours meet at the ends of their moves most of the time, also where the curves themselves only touch or
  // run along each other.
  for (const Point& end : {one.from, one.to, two.from, two.to}) points.add(end);
  if (one.turn == 0 && two.turn == 0)
    cross_lines(one, two, points);
  else if (one.turn == 0)
    cross_line_and_circle(one, two, points);
  else if (two.turn == 0)
    cross_line_and_circle(two, one, points);
  else
    cross_circles(one, two, points);
  Meetings found;
  for (std::size_t i = 0; i < points.count; ++i) {
    const Point& p = points.at[i];
    TRN_CHECK(found.count < found.at.size());
    if (distance(p, one) <= touch && distance(p, two) <= touch)
      found.at[found.count++] = {fraction_of(one, p), fraction_of(two, p)};
  }
  return found;
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
  // An arc reaches beyond its ends where it passes east, north, west or south of its centre.
  for (const Point& way : {Point(1, 0), Point(0, 1), Point(-1, 0), Point(0, -1)})
    if (faces(curve, curve.centre + way)) box.extend(Point(curve.centre + r * way));
  return box;
}

}  // namespace trn
