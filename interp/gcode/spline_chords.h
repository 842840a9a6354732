#pragma once

#include <vector>

#include "core/frames.h"

namespace trn {

/// Cubic pieces, four control points each, as the ends of chords that stay within 2 um of them; `scale` is a
/// unit of theirs in mm. All of a curve's chords are made at once, as they share its time. GcodeError for a
/// curve of more than some 10 km.
std::vector<Vec3> spline_chords(const std::vector<Vec3>& hull, double scale);

}  // namespace trn
