#pragma once

#include <algorithm>

#include "core/path.h"

namespace trn {

/// A vertex of the programmed polyline; u is the path parameter along the polyline.
struct RunVertex {
  double u = 0;
  Words y;  ///< relative to an origin near by
};

/// Shortest span of a fitted spline, mm and degrees.
inline constexpr double kSpanMin = 1e-3;

/// Deviation over tolerance, the worse of position and rotary words.
inline double tube_usage(const Words& deviation, double tolerance_mm, double tolerance_rad) {
  const auto part = [](double d, double tol) { return d <= 1e-12 ? 0 : (tol > 0 ? d / tol : 1e9); };
  return std::max(part(deviation.head<3>().norm(), tolerance_mm),
                  part(deviation.tail<3>().norm(), tolerance_rad));
}

}  // namespace trn
