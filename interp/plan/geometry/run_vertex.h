#pragma once

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "core/path.h"

namespace trn {

/// Weight of a rotation against a length in a run's parameter, mm per rad: a degree counts as 0.3 mm. In the
/// path norm a degree counts as 1 mm. Where a tool turns to and fro by several degrees a millimetre, a curve
/// by that norm would bend sharply, and samples would tell little of it.
inline constexpr double kMmPerRadInRun = 0.3 * kMmPerRadInPath;

/// Length of a chord (mm and rad) in a run's parameter, mm.
inline double run_length(const Words& chord) {
  return std::hypot(chord.head<3>().norm(), kMmPerRadInRun * chord.tail<3>().norm());
}

/// A vertex of the programmed polyline; u is the run's parameter along the polyline.
struct RunVertex {
  double u = 0;
  Words y;                    ///< relative to an origin near by
  double tolerance_used = 0;  ///< share of the tolerances by which the chord up to here may leave the program
};

/// Shortest span of a fitted spline, mm and degrees.
inline constexpr double kSpanMin = 1e-3;

/// The point of the line y = slope * t that is nearest to `deviation`, as its t. Distances are weighed by the
/// tolerances, position against rotary words (zero rotary tolerance: position alone). A curve that passes a
/// point of the polyline early or late by t is still on the path, so only deviation - slope * t counts.
inline double nearest_along(const Words& deviation, const Words& slope, double tolerance_mm,
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

/// 0 where the deviation is rounding; 1e9 where a tolerance is 0 and the deviation is not.
inline TubeUse tube_use(const Words& deviation, double tolerance_mm, double tolerance_rad) {
  const auto part = [](double d, double tol) { return d <= 1e-12 ? 0 : (tol > 0 ? d / tol : 1e9); };
  return {part(deviation.head<3>().norm(), tolerance_mm), part(deviation.tail<3>().norm(), tolerance_rad)};
}

}  // namespace trn
