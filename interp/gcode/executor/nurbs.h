#pragma once

#include <Eigen/Dense>
#include <vector>

#include "core/frames.h"

namespace trn {

/// A rational B-spline curve. Point i has weight `points[i][3]` and the coordinates before it.
struct NurbsCurve {
  int order = 4;              ///< degree + 1
  std::vector<double> knots;  ///< points + order of them, not falling
  std::vector<Eigen::Vector4d> points;

  double first() const { return knots[static_cast<std::size_t>(order) - 1]; }
  double last() const { return knots[points.size()]; }
  /// The point at parameter u in [first, last] (de Boor's recursion on weighted points).
  Vec3 at(double u) const;
};

/// Knots 0 .. 0 1 2 .. n .. n, each end as often as the order.
std::vector<double> clamped_uniform_knots(std::size_t points, int order);

/// The curve as cubic Bezier hulls (4 points each), each through four points of it; 16 pieces for every span
/// between different knots.
std::vector<Vec3> cubic_hulls(const NurbsCurve& curve);

}  // namespace trn
