#include "sim/micromill/guide_friction.h"

#include <cmath>

namespace trn {

double GuideFriction::level_N(double v_mm_s) const TRN_RT {
  const bool up = v_mm_s >= 0;
  const double coulomb = up ? config_.coulomb_up_N : config_.coulomb_down_N;
  const double at_rest = up ? config_.static_up_N : config_.static_down_N;
  // Stribeck's curve: a film builds up with the speed, and friction falls from its level at rest to
  // Coulomb's.
  const double ratio = v_mm_s / config_.stribeck_mm_s;
  return coulomb + (at_rest - coulomb) * std::exp(-ratio * ratio);
}

double GuideFriction::step(double v_mm_s, double dt_s) TRN_RT {
  // dz/dt = v - |v| z / (level / stiffness), backward Euler: stable at any speed.
  const double limit_mm = level_N(v_mm_s) / config_.bristle_N_mm;
  const double before = bend_mm_;
  bend_mm_ = (before + dt_s * v_mm_s) / (1 + dt_s * std::abs(v_mm_s) / limit_mm);
  // Stiffness of the bristles, their damping, and the oil: the three terms of the LuGre law.
  return config_.bristle_N_mm * bend_mm_ + config_.bristle_N_s_mm * (bend_mm_ - before) / dt_s +
         config_.viscous_N_s_mm * v_mm_s;
}

double GuideFriction::sliding_N(double v_mm_s) const TRN_RT {
  return std::copysign(level_N(v_mm_s), v_mm_s) + config_.viscous_N_s_mm * v_mm_s;
}

}  // namespace trn
