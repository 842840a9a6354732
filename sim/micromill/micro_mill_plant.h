#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <optional>

#include "core/realtime.h"
#include "sim/micromill/linear_motor_axis.h"
#include "sim/micromill/milling_cutter.h"
#include "sim/micromill/part_surface.h"

namespace trn {

/// The micro-mill as it really is: two linear motor axes under the work, a cutter that bends, the plate it
/// cuts and, for the pressing test, a hard block beside it. Joint coordinates: the tool's place over the
/// work. The top of the plate is z = 0.
class MicroMillPlant {
 public:
  struct Config {
    std::array<LinearMotorAxis::Config, 2> axes;
    MillingCutter::Config cutter;
    std::array<double, 2> block_mm{27.0, 27.0};  ///< the tool's place where it touches the block, per axis
    double plate_mm = 0.1;                       ///< thickness
    int steps_per_period = 48;
    double period_s = 0.001;
  };

  explicit MicroMillPlant(const Config& config);

  /// The plate from which a part is cut next; none: the spindle turns in the air.
  void clamp(const std::optional<PartSurface::Config>& part);
  /// The block stands on the stage or not.
  void set_block(bool present) { block_present_ = present; }
  /// One period with the joints' setpoints (X, Y in the drives' hands, Z ideal), mm.
  void step(const Eigen::Vector3d& target_mm) TRN_RT;

  LinearMotorAxis& axis(int index) { return axes_[static_cast<std::size_t>(index)]; }
  const LinearMotorAxis& axis(int index) const TRN_RT { return axes_[static_cast<std::size_t>(index)]; }
  const std::optional<PartSurface>& part() const { return part_; }
  double z_mm() const TRN_RT { return z_mm_; }

  // The truth, for the judges only: means over the last period.
  const Eigen::Vector2d& tool_force_N() const TRN_RT { return tool_force_N_; }    ///< on the tool
  const Eigen::Vector2d& disturbance_N() const TRN_RT { return disturbance_N_; }  ///< friction and ripple
  const Eigen::Vector2d& deflection_mm() const TRN_RT { return deflection_mm_; }  ///< of the tool's tip

 private:
  Eigen::Vector2d block_force_N(const Eigen::Vector2d& holder_mm) const TRN_RT;

  Config config_;
  std::array<LinearMotorAxis, 2> axes_;
  MillingCutter cutter_;
  std::optional<PartSurface> part_;
  PartSurface air_;
  bool block_present_ = false;
  double z_mm_ = 0;
  Eigen::Vector2d tool_force_N_ = Eigen::Vector2d::Zero(), disturbance_N_ = Eigen::Vector2d::Zero(),
                  deflection_mm_ = Eigen::Vector2d::Zero();
};

/// The stage of docs/sources.md S5 with the simulator's own friction, ripple and cutter. Seed 0 is the
/// nominal plant; with any other, mass, motor constant, friction, ripple, cutter and noise differ from it.
MicroMillPlant::Config micro_mill_plant(std::uint64_t seed, double period_s);
/// The `count`-th cutter of a plant: as the first, but mounted anew (run-out) and more or less worn.
MillingCutter::Config another_cutter(const MicroMillPlant::Config& plant, std::uint64_t seed, int count);

}  // namespace trn
