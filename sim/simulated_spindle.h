#pragma once

#include "core/ports.h"

namespace trn {

/// A spindle with an encoder, stepped once a period: its speed changes at a constant rate, and it stops where
/// it is told.
class SimulatedSpindle {
 public:
  struct Config {
    double period_s = 0.001;
    double acceleration_rpm_s = 0;  ///< 0: any speed at once
    double load_share = 0;          ///< the speed waves by this share, as under an uneven cut
    double load_hz = 2;
  };

  explicit SimulatedSpindle(const Config& config) : config_(config) {}

  /// Takes the spindle's part of the outputs, gives that of the inputs.
  void step(const IoOutputs& outputs, IoInputs& inputs) TRN_RT;

 private:
  void turn(double rpm) TRN_RT;
  bool orient(double deg) TRN_RT;
  bool gear(double turns) TRN_RT;

  Config config_;
  double rpm_ = 0, turns_ = 0, time_s_ = 0;
  bool geared_ = false;
  double geared_from_ = 0;  ///< turns where the gear was closed
};

}  // namespace trn
