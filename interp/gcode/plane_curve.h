#pragma once

#include <Eigen/Dense>

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

/// Angle of an arc from one point to another about `centre`, in the sense of `turn`, in (0, 2 pi].
double sweep_of(const PlaneCurve::Point& centre, const PlaneCurve::Point& from, const PlaneCurve::Point& to,
                int turn);

/// The least distance of a point and a curve, and of two curves; exact.
double distance(const PlaneCurve::Point& p, const PlaneCurve& curve);
double distance(const PlaneCurve& one, const PlaneCurve& two);

/// The smallest upright rectangle around a curve.
using PlaneBox = Eigen::AlignedBox2d;
PlaneBox box_of(const PlaneCurve& curve);

}  // namespace trn
