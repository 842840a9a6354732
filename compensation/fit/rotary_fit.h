#pragma once

#include <string>

#include "compensation/actual_chain.h"

// What the fits of the rotary axes' errors, by ball bar and by a touched ball, have in common.
namespace trn {

inline constexpr double kTiltArm_mm = 100;          ///< a tilt counts as the shift it makes at this distance
inline constexpr double kDifferenceStep_mm = 1e-3;  ///< of the numerical differences
inline constexpr double kTellableShare =
    0.02;  ///< of a column, which no other column explains: else not fitted

/// "A", "B" or "C": the machine axis that a rotary axis is nearest to.
inline std::string axis_name(const ActualAxis& axis) {
  int k = 0;
  axis.direction.cwiseAbs().maxCoeff(&k);
  return std::string(1, "ABC"[k]);
}

}  // namespace trn
