#include "interp/plan/speed/joint_rates.h"

namespace trn::speed {

JointRates joint_rates(const Joints& joints, double acceleration_share, double jerk_share) {
  JointRates rates;
  rates.count = static_cast<int>(joints.size());
  for (size_t i = 0; i < joints.size(); ++i) {
    rates.velocity[i] = joints[i].limit.velocity;
    rates.acceleration[i] = joints[i].limit.acceleration * acceleration_share;
    rates.jerk[i] = joints[i].limit.jerk * jerk_share;
    rates.velocity_inverse[i] = 1 / rates.velocity[i];
    rates.acceleration_inverse[i] = 1 / rates.acceleration[i];
    rates.jerk_inverse[i] = 1 / rates.jerk[i];
  }
  return rates;
}

}  // namespace trn::speed
