#pragma once

#include <optional>
#include <span>

#include "core/axes.h"
#include "interp/plan/geometry/quintic_spline.h"
#include "interp/plan/geometry/run_vertex.h"

namespace trn {

/// What is given at one end of the curve to be fitted.
enum class RunEnd : unsigned char {
  kPoint,   ///< the vertex itself
  kCorner,  ///< the same, and a blend follows that wants short spans and little deviation beside it
  kOnLine,  ///< the first (last) chord's own line, with three derivatives
  kFrozen   ///< start only: continues the spline fitted before
};

/// The part of a fitted spline that a later fit may not change: the knots around its start and the
/// coefficients that reach over it.
struct FrozenHead {
  std::array<double, 11> knots;  ///< the start is knots[5]
  std::array<Words, 5> coefficients;
};

struct RunRequest {
  std::span<const RunVertex> vertices;  ///< at least two; frozen start: the first is at or before it
  RunEnd start = RunEnd::kPoint, end = RunEnd::kPoint;
  const FrozenHead* head = nullptr;  ///< kFrozen
  double tolerance_mm = 0, tolerance_rad = 0;
};

struct RunFit {
  QuinticSpline spline;
  std::vector<TubeUse> usage;  ///< per span
  bool ok = false;             ///< inside the tolerances everywhere
  size_t worst_vertex = 0;     ///< !ok: the one nearest to the worst place
};

/// Fits a quintic spline to the polyline: the smoothest (P2 of docs/planner.md) in the tube of the
/// tolerances, whatever the density of the vertices. Deviation is measured at equal parameters, hence an
/// upper bound of the distance.
RunFit fit_run(const RunRequest& request);

}  // namespace trn
