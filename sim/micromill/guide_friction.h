#pragma once

#include "core/realtime.h"

namespace trn {

/// Friction of a guide by the LuGre law (Canudas de Wit et al., 1995): bristles that bend before they slide,
/// so that friction at rest depends on how the axis came to rest; a Stribeck curve whose levels differ
/// between the directions. Lengths in mm, forces in N.
class GuideFriction {
 public:
  struct Config {
    double coulomb_up_N = 0, coulomb_down_N = 0;  ///< moving towards plus, towards minus
    double static_up_N = 0, static_down_N = 0;    ///< just before it slides
    double stribeck_mm_s = 1;                     ///< speed over which static falls to Coulomb friction
    double viscous_N_s_mm = 0;
    double bristle_N_mm = 1;    ///< stiffness before it slides
    double bristle_N_s_mm = 0;  ///< damping of the bristles
  };

  explicit GuideFriction(const Config& config) : config_(config) {}

  /// Advances by `dt_s` at speed `v_mm_s`; returns the force that opposes the motion, N.
  double step(double v_mm_s, double dt_s) TRN_RT;
  /// Force in steady sliding at a speed other than zero, N.
  double sliding_N(double v_mm_s) const TRN_RT;

 private:
  double level_N(double v_mm_s) const TRN_RT;

  Config config_;
  double bend_mm_ = 0;
};

}  // namespace trn
