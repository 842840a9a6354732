#pragma once

#include <cmath>
#include <optional>

#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_fit.h"
#include "core/axes.h"

namespace trn {

/// Motor and load on a spring, as the answers to a motor that is shaken show them.
struct StirredLoop {
  double resonance_hz = 0;   ///< motor against load; 0: nothing swings
  double deviation_hz = 0;   ///< by halves of what was seen
  double damping = 0;        ///< 1: critical
  double share = 0;          ///< of the inertia, the load's
  double seen_up_to_hz = 0;  ///< beyond, nothing certain was seen
  double nyquist_hz = 0;     ///< half of the periods in a second

  /// Load against a motor that is held.
  double swing_hz() const { return resonance_hz * std::sqrt(1 - share); }
};

/// Nothing: the motor was not shaken, or too little was seen of it. The torque that it was told is what its
/// answers are compared with, so that the drive's own loops do not matter; and the model is that of a force
/// that holds for a period, so that it is right up to half of the periods in a second.
std::optional<StirredLoop> measure_stirred(const TuneData& data, const TuneFit& fit, const Joint& joint);

}  // namespace trn
