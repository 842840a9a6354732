#pragma once

#include <vector>

#include "interp/plan/geometry/run_target.h"

namespace trn {

/// The longest span that a spline may have at u.
struct SpanLimit {
  double u = 0, span = 0;
};

struct SpanMeshRequest {
  const RunTarget& target;
  double start = 0, end = 0;  ///< range of u, inside that of the target's vertices
  double tolerance_mm = 0, tolerance_rad = 0;
  std::vector<SpanLimit> limits;  ///< ascending in u; spans grow with the distance from these places
};

/// Breaks from start to end, both included, so close that a quintic spline on them can follow the target well
/// inside the tolerances. A target run backwards has the same breaks.
std::vector<double> mesh_breaks(const SpanMeshRequest& request);

}  // namespace trn
