#pragma once

#include <algorithm>
#include <cmath>

#include "core/path.h"

namespace trn {

/// Weight of a rotation against a length in a run's parameter, mm per rad: a degree counts as 0.3 mm. Where a
/// tool turns to and fro by several degrees a millimetre, a curve bends sharply over its length in the path
/// norm, so that samples tell little of it; over the tip's way it does not.
inline constexpr double kMmPerRadInRun = 0.3 * kMmPerRadInPath;

/// Length of a chord (mm and rad) in a run's parameter, mm.
inline double run_length(const Words& chord) {
  return std::hypot(chord.head<3>().norm(), kMmPerRadInRun * chord.tail<3>().norm());
}

/// A vertex of the programmed polyline; u is the run's parameter along the polyline.
struct RunVertex {
  double u = 0;
  Words y;          ///< relative to an origin near by
  double lost = 0;  ///< share of the tolerances that the chord up to here is off the programmed path
};

/// Shortest span of a fitted spline, mm and degrees.
inline constexpr double kSpanMin = 1e-3;

/// Where along a line y = slope * t a deviation from it is least, position and rotary words weighed by their
/// tolerances: who is off by `deviation` is off by deviation - slope * t from another place of the line.
inline double place_along(const Words& deviation, const Words& slope, double tolerance_mm,
                          double tolerance_rad) {
  const double mm = 1 / (tolerance_mm * tolerance_mm);
  const double rad = tolerance_rad > 0 ? 1 / (tolerance_rad * tolerance_rad) : 0;
  const double squared = mm * slope.head<3>().squaredNorm() + rad * slope.tail<3>().squaredNorm();
  const double product =
      mm * slope.head<3>().dot(deviation.head<3>()) + rad * slope.tail<3>().dot(deviation.tail<3>());
  return squared > 0 ? product / squared : 0;
}

/// Deviation over tolerance, of position and of the rotary words.
struct TubeUse {
  double linear = 0, rotary = 0;
  double worst() const { return std::max(linear, rotary); }
  void raise(const TubeUse& by) {
    linear = std::max(linear, by.linear);
    rotary = std::max(rotary, by.rotary);
  }
};

inline TubeUse tube_use(const Words& deviation, double tolerance_mm, double tolerance_rad) {
  const auto part = [](double d, double tol) { return d <= 1e-12 ? 0 : (tol > 0 ? d / tol : 1e9); };
  return {part(deviation.head<3>().norm(), tolerance_mm), part(deviation.tail<3>().norm(), tolerance_rad)};
}

}  // namespace trn
