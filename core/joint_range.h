#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/axes.h"
#include "core/config.h"
#include "core/units.h"

namespace trn {

/// Where a joint may be, in the unit of its config's keys: mm or degrees. For example, -120 degrees come back
/// from rad as -119.99999999999999, and are the end of the joint all the same. So an end is the short decimal
/// that it is but for the last bits, or that much further out; `place_of` leads back into the joint's own.
inline Range range_of_places(const Joint& joint) {
  const double unit = joint.kind == JointKind::kRotary ? kDegPerRad : 1;
  const auto end_of = [](double end, double outwards) {
    const double decimal = std::round(1e9 * end) / 1e9;
    const double last_bits = 4 * std::numeric_limits<double>::epsilon() * std::abs(end);
    return std::abs(decimal - end) <= last_bits ? decimal : end + outwards * last_bits;
  };
  return {end_of(unit * joint.limit.min, -1), end_of(unit * joint.limit.max, 1)};
}

/// A place that a config gives in that unit, in mm or rad.
inline double place_of(const Joint& joint, double given) {
  const double unit = joint.kind == JointKind::kRotary ? kRadPerDeg : 1;
  return std::clamp(unit * given, joint.limit.min, joint.limit.max);
}

}  // namespace trn
