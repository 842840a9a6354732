#pragma once

#include <memory>

#include "compensation/actual_chain.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

enum class GeometricMode : unsigned char {
  kPosition,  ///< the linear joints put the tip right; the rotary joints stay as programmed
  kFull,      ///< the rotary joints put the tool axis right too
};

struct GeometricConfig {
  ActualChain chain;
  GeometricMode mode = GeometricMode::kFull;
  double limit_mm = 5;                      ///< greatest correction of a linear joint
  double limit_rad = 0.017453292519943295;  ///< of a rotary joint; bounds `full` near a pole
};

/// What a correction leaves: distance of the tip, angle of the tool axis.
struct PoseResidual {
  double tip_mm = 0, axis_rad = 0;
};

/// Finds the joints whose actual chain puts tip and tool axis where the nominal machine would
/// (docs/sources.md S1.5). A fixed number of Newton steps from the nominal joints: pure, and as smooth as the
/// errors.
///
/// Near a pole an axis error across the pole would ask for an endless turn of the axis that is parallel to
/// the tool. There the turn is damped: it minimises |axis error|^2 + lambda^2 |turn|^2 with
/// lambda = lambda0 (1 - s^2/s0^2)^2 while the chain's smallest gain s is below s0 = 2 lambda0, else 0, so
/// the solution is exact away from the pole and has continuous third derivatives. With lambda0 = (sum of
/// tilts) / limit_rad no turn exceeds its limit. `residual` says what is left of the axis error.
class GeometricCorrection final : public PoseCorrection {
 public:
  /// std::invalid_argument unless the chain has three linear and at most two rotary joints.
  explicit GeometricCorrection(const GeometricConfig& config);

  KinStatus correct(const Pose& X_BS, const Vec3& tool_offset, JointVec& q) const TRN_RT override;
  KinStatus actual(const JointVec& q, Pose& X_BS) const TRN_RT override;

  /// Outside the tick: what joints q miss of the pose.
  PoseResidual residual(const Pose& X_BS, const Vec3& tool_offset, const JointVec& q) const;
  GeometricMode mode() const { return config_.mode; }

 private:
  struct Wanted {
    Vec3 p_B, u_B, tool_offset;
  };
  struct Miss;

  Miss miss_at(const Wanted& wanted, const JointVec& q) const TRN_RT;
  double damping2(const Miss& miss) const TRN_RT;
  void step(const Miss& miss, double damping2, const JointVec& nominal, JointVec& q) const TRN_RT;
  bool inside_limits(const JointVec& nominal, const JointVec& q) const TRN_RT;

  GeometricConfig config_;
  std::array<int, 3> linear_{};
  std::array<int, 2> rotary_{};
  int rotary_count_ = 0;
  double lambda0_ = 0;
};

/// The tables [[axis]] of a section of geometric errors, put into `chain`: joint, ex0_mm .. ez0_mm,
/// ea0_arcsec .. ec0_arcsec and [axis.table]. ConfigError as ConfigTable.
void read_axis_errors(const Machine& machine, const ConfigTable& section, ActualChain& chain);

/// Section [corrections.geometric].
GeometricConfig read_geometric(const Machine& machine, const ConfigTable& section);

}  // namespace trn
