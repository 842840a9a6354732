#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/lab/micromill/programs.h"
#include "compensation/fit/network_training.h"
#include "compensation/fit/tool_stiffness.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/micromill/friction_network.h"
#include "compensation/micromill/load_observer.h"
#include "core/fault.h"
#include "sim/micromill/micro_mill_plant.h"
#include "sim/micromill/part_surface.h"

namespace trn {

/// One period of a run on the simulated stage: what the kernel saw, what it estimated, and the truth.
struct StageRow {
  Eigen::Vector2d plan_mm, setpoint_mm, measured_mm, current_A;
  Eigen::Vector2d load_N, friction_N, force_N, deflection_mm, innovation_rms_mm;  ///< estimates
  Eigen::Vector2d true_force_N, true_disturbance_N, true_deflection_mm;
  std::uint32_t line = 0;
  bool alarm = false;   ///< the estimator's
  bool counts = false;  ///< its line is one of the program's that count
};

struct StageRun {
  std::vector<StageRow> rows;
  Fault fault = Fault::kOk;
  bool within_limits = false;      ///< every joint, judged on the setpoints with the correction in them
  double size_mm[2] = {0, 0};      ///< of the part, measured: diameter (twice), or widths along X and Y
  std::vector<double> surface_mm;  ///< of the part, as PartSurface::distances_mm
};

/// What stands on the stage while a program runs.
struct StageSetup {
  std::optional<PartSurface::Shape> part;
  int cutter = 0;  ///< which one; each is mounted anew
  bool block = false;
};

/// A simulated micro-mill and the kernel that drives it: every program goes through interpreter, planner and
/// tick. The estimator's numbers come from the machine's config (section [corrections.deflection]).
class StageLab {
 public:
  /// ConfigError if the config has no such section or cannot be used.
  /// `seed` picks the stage; without one it is the config's own.
  explicit StageLab(std::string config_path, std::optional<std::uint64_t> seed = std::nullopt);

  /// Runs a program with `correction` in the tick; null: only loads are estimated there.
  StageRun run(const LabProgram& program, const StageSetup& setup,
               const DeflectionCorrection::Config* correction) const;

  /// Something happens to the stage: from now on it is another one than training saw.
  void change_plant(const MicroMillPlant::Config& plant) { plant_ = plant; }

  const DeflectionCorrection::Config& nominal() const { return nominal_; }
  const MicroMillPlant::Config& plant() const { return plant_; }
  std::uint64_t seed() const { return seed_; }

 private:
  std::string config_path_;
  std::uint64_t seed_ = 0;
  MicroMillPlant::Config plant_;
  DeflectionCorrection::Config nominal_;
};

/// Taps and loads of the rows that count, on one axis; `stride`: every so many periods.
TrainingSet training_set(const StageRun& run, const LoadObserver::Config& observer,
                         const DelayLine::Config& line, int axis, int stride,
                         double* innovation_rms_mm = nullptr);

/// The shapes that `sweep` compares and `train` uses.
struct TrainChoice {
  FrictionNetwork::Shape shape;
  TrainingOptions options;
};
/// Learns friction and ripple of both axes from runs of the sine program; `validation` judges.
StageNetworks train_stage(const StageLab& lab, const StageRun& sines, const StageRun& validation,
                          const TrainChoice& choice);

/// The pressing test along an axis.
struct PressingResult {
  StiffnessFit fit;
  double true_N_mm = 0;
  double force_error_N = 0;  ///< rms of estimated less true force; creeping, friction's direction is unknown
};
PressingResult press(const StageLab& lab, const StageNetworks& networks, int axis);

/// `nominal` with the networks and stiffnesses in it.
DeflectionCorrection::Config learnt(const StageLab& lab, const StageNetworks& networks,
                                    const Eigen::Vector2d& stiffness_N_mm, double gain);

}  // namespace trn
