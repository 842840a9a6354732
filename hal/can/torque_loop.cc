#include "hal/can/torque_loop.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

void TorqueLoop::restart(double measured) TRN_RT {
  q_.fill(measured);
  measured_ = measured;
  integral_ = 0;
}

double TorqueLoop::step(double q, double measured) TRN_RT {
  TRN_CHECK(config_.period_s > 0 && config_.integral_time_s > 0);
  std::rotate(q_.begin(), q_.end() - 1, q_.end());
  q_[0] = q;
  const double wanted = (q_[2] - q_[3]) / config_.period_s + config_.gain_1_s * (q_[2] - measured);
  const double error = wanted - (measured - measured_) / config_.period_s;
  measured_ = measured;
  const double integral = integral_ + config_.damping * error * config_.period_s / config_.integral_time_s;
  integral_ = std::clamp(integral, -config_.force_max, config_.force_max);
  return config_.damping * error + integral_;
}

}  // namespace trn
