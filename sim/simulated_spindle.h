#pragma once

#include "core/ports.h"

namespace trn {

/// A spindle with an encoder, stepped once a period: the speed it aims at changes at a constant rate, its own
/// lags behind that, and it stops where it is told.
class SimulatedSpindle {
 public:
  struct Config {
    double period_s = 0.001;
    double acceleration_rpm_s = 0;  ///< 0: any speed at once
    double lag_s = 0;               ///< of its speed behind the one it aims at, first order
    double load_share = 0;          ///< the speed waves by this share, as under an uneven cut
    double load_hz = 2;
  };

  explicit SimulatedSpindle(const Config& config);

  /// Takes the spindle's part of the outputs, gives that of the inputs.
  void step(const IoOutputs& outputs, IoInputs& inputs) TRN_RT;

 private:
  void turn(double rpm) TRN_RT;
  bool orient(double deg) TRN_RT;

  Config config_;
  double follows_;  ///< share of the lag made good in a period
  double aim_rpm_ = 0, rpm_ = 0, turns_ = 0, time_s_ = 0;
};

}  // namespace trn
