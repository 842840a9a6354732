#pragma once

#include <Eigen/Dense>

#include "core/realtime.h"

namespace trn {

/// A position loop as a second-order system, solved exactly over one period:
///   x'' = wn^2 (target - x) + 2 zeta wn (ff target' - x')
/// The target runs linearly from the last period's value to this one's, as a CSP drive interpolates
/// (CiA 402-2, cyclic synchronous position mode).
class Servo {
 public:
  struct Config {
    double natural_frequency_rad_s = 0;  ///< wn > 0
    double damping = 0;                  ///< zeta >= 0; 1 is critical
    double velocity_feed_forward = 0;    ///< ff; 1: no lag at constant speed
    double period_s = 0;
  };
  struct State {
    double x = 0, v = 0;  ///< position and speed of the joint, mm or rad, per s
    double target = 0;    ///< end of the last period's target
  };

  explicit Servo(const Config& config);

  /// Advances one period towards `target`.
  void step(double target, State& state) const TRN_RT;

 private:
  Config config_;
  Eigen::Matrix2d transition_;  ///< (e, e') over one period
};

}  // namespace trn
