#pragma once

#include "core/path.h"
#include "interp/plan/geometry/path_item.h"

namespace trn {

/// How two neighbouring items meet.
struct Junction {
  enum class Kind : unsigned char { kStop, kSmooth, kBlend };
  Kind kind = Kind::kStop;
  double span = 0;  ///< kBlend: parameter length that the blend takes from each side
};

/// What the blend may use: deviations from the programmed path, and the span on each side.
struct BlendBounds {
  double tolerance_mm = 0, tolerance_rad = 0, span_max = 0;
};

/// A stop is planned where the path turns (in the path norm) by more than this. The blend's y' would all but
/// vanish there, and the blend would cost more time than the stop.
inline constexpr double kReversalCos = -0.99619469809174555;  // cos 175 deg

/// A shorter blend than this would be slower than a stop.
inline constexpr double kBlendSpanMin = 1e-5;

/// The blend of two lines is y' = (1 - g) t0 + g t1 with g the quintic smoothstep (P1 of docs/planner.md). It
/// misses the corner by this times span |t1 - t0|: twice the integral of g over its first half.
inline constexpr double kCornerMiss = 0.15625;

/// The septic from `span` before the end of `before` to `span` after the start of `after`, of parameter
/// length 2 span, with three derivatives continuous at both ends.
PathPiece make_blend(const PathPiece& before, const PathPiece& after, double span);

/// Largest ratio of deviation to tolerance of that blend. The deviation is measured from the programmed path
/// at the same parameter: an upper bound of the distance to the path, and in the middle the distance to the
/// programmed corner. Infinite where |y'| of the blend all but vanishes.
double blend_usage(const PathPiece& before, const PathPiece& after, double span, const BlendBounds& bounds);

/// Largest span within the bounds, 0 when none.
double largest_span(const PathPiece& before, const PathPiece& after, const BlendBounds& bounds);

/// Classifies the junction and, for a blend, gives the largest span when nothing else wants the two items.
Junction classify(const PathItem& before, const PathItem& after);

}  // namespace trn
