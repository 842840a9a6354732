#pragma once

#include <Eigen/Dense>
#include <array>

namespace trn {

/// A straight line (turn 0) or an arc about `centre` (turn +1 counterclockwise, -1 clockwise; never more than
/// one turn) in a plane.
struct PlaneCurve {
  using Point = Eigen::Vector2d;
  Point from, to;
  Point centre = Point::Zero();
  int turn = 0;

  double radius() const { return (from - centre).norm(); }
};

inline double cross(const PlaneCurve::Point& a, const PlaneCurve::Point& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Angle of an arc from one point to another about `centre`, in the sense of `turn`, in (0, 2 pi].
double sweep_of(const PlaneCurve::Point& centre, const PlaneCurve::Point& from, const PlaneCurve::Point& to,
                int turn);

/// The centre nearest to `given` that has both ends at one distance; the ends are apart.
PlaneCurve::Point centre_between(const PlaneCurve::Point& from, const PlaneCurve::Point& to,
                                 const PlaneCurve::Point& given);

double length_of(const PlaneCurve& curve);
/// Area that a ray from the origin sweeps over while its end runs along the curve; positive counterclockwise.
double swept_area(const PlaneCurve& curve);

/// Points of a curve by the fraction of its length, 0 to 1: the point there, the fraction of the curve's
/// point nearest to `p`, and the piece between two fractions.
PlaneCurve::Point point_at(const PlaneCurve& curve, double fraction);
double fraction_of(const PlaneCurve& curve, const PlaneCurve::Point& p);
PlaneCurve piece_of(const PlaneCurve& curve, double first, double last);
/// Unit direction at the curve's start or end.
PlaneCurve::Point direction_of(const PlaneCurve& curve, bool at_end);

/// Where two curves cross, and where an end of one lies on the other, by the fractions of both lengths.
struct Meetings {
  struct Fractions {
    double one, two;
  };
  std::array<Fractions, 6> at;  ///< the first `count`
  std::size_t count = 0;
};
/// `touch`: points nearer than this are one point.
Meetings meetings(const PlaneCurve& one, const PlaneCurve& two, double touch);

/// The least distance of a point and a curve, and of two curves; exact.
double distance(const PlaneCurve::Point& p, const PlaneCurve& curve);
double distance(const PlaneCurve& one, const PlaneCurve& two);

/// The smallest upright rectangle around a curve.
using PlaneBox = Eigen::AlignedBox2d;
PlaneBox box_of(const PlaneCurve& curve);

}  // namespace trn
