#pragma once

#include <array>

#include "core/realtime.h"

namespace trn {

/// The master's own position and velocity loop of a drive in cyclic torque mode: P on the position, PI on the
/// velocity. It compares what was measured with the setpoint that the measurement belongs to, two periods
/// old.
class TorqueLoop {
 public:
  struct Config {
    double gain_1_s = 20;  ///< velocity asked for, over the position's error
    double damping = 0;    ///< N per mm/s, Nm per rad/s: force over the velocity's error
    double integral_time_s = 0.05;
    double force_max = 0;  ///< N, Nm, of the integral part
    double period_s = 0.001;
  };

  explicit TorqueLoop(const Config& config) : config_(config) {}

  /// The axis stands at `measured`, without force.
  void restart(double measured) TRN_RT;
  /// A period: the newest setpoint and the newest measurement; returns N or Nm.
  double step(double q, double measured) TRN_RT;

 private:
  Config config_;
  std::array<double, 4> q_{};  ///< setpoints, newest first
  double measured_ = 0, integral_ = 0;
};

}  // namespace trn
