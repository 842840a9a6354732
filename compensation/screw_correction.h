#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "compensation/screw_heat.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "core/ring.h"

namespace trn {

/// Where the temperature of a screw comes from.
struct ScrewSensor {
  int channel = -1;  ///< of the board, degrees Celsius; -1: the model alone
  std::string name;
  double at_mm = 0;  ///< place along the screw
  double reference_C = 20, min_C = -10, max_C = 120, rate_max_K_s = 2;
  double timeout_s = 10;
  bool hold_on_dropout = false;  ///< else the model goes on alone
};

struct ScrewConfig {
  int joint = 0;
  double fixed_bearing_mm = 0, far_bearing_mm = 0;  ///< places along the joint's own scale
  ScrewMounting mounting = ScrewMounting::kFixedFree;
  double stretch_mm = 0, alpha_per_K = 11.7e-6;
  ScrewHeat heat;
  ScrewSensor sensor;
};

struct ScrewCorrectionConfig {
  std::vector<ScrewConfig> screws;
  double period_s = 0.001;
  double update_s = 0.1;     ///< of the heat model; a spline in time leads from profile to profile
  double slope_max = 5e-4;   ///< greatest growth per length
  double rate_mm_s = 0.005;  ///< greatest change of the offset at a place
};

/// Growth of ball screws, taken off the motor joints; behind RTCP, so that it cures the direct and the
/// indirect error alike (docs/sources.md S2.4). Joints with a linear encoder have none. The tick adds up the
/// way of the nut and evaluates profiles (cubic splines); `work`, outside the tick, steps the heat models,
/// heeds the sensors and sends the next profiles.
class ScrewCorrection final : public SetpointCorrection {
 public:
  static constexpr int kNodes = 61;
  /// `board` must outlive the correction.
  ScrewCorrection(const ScrewCorrectionConfig& config, const SensorBoard& board);

  void wanted(const CorrectionInput& input, JointVec& offset) TRN_RT override;
  unsigned joint_mask() const override;
  double slope_max() const TRN_RT override { return config_.slope_max; }
  const char* warning() const TRN_RT override;

  /// Outside the tick, several times per `update_s`; one thread.
  void work();
  /// Temperature rise that the correction works with, K by node; for reports, in the thread of `work`.
  const std::vector<double>& rise_K(std::size_t screw) const { return workers_[screw].used_K; }

 private:
  struct Way {
    std::array<double, kNodes> mm{};
    SensorBoard::Heard sensor;
  };
  struct Profile {
    std::array<double, kNodes> u{}, m{};  ///< displacement and its second derivative, mm
    double at(double x_mm, double spacing_mm) const TRN_RT;
  };
  /// The tick's half of a screw.
  struct Nut {
    double direction = 1, length_mm = 0, spacing_mm = 1, last_mm = 0;
    bool seen = false;
    Way way;
    std::array<Profile, 4> profiles_now;  ///< the last four, oldest first
    std::unique_ptr<Ring<Way>> ways;
    std::unique_ptr<Ring<Profile>> profiles;
  };
  /// The worker's half of a screw: its heat model, its sensor, and what it sends to the tick.
  struct Worker {
    ScrewHeatModel model;
    std::vector<double> used_K, u_mm;
    double last_C = 0, silent_s = 0, absurd_s = 0;
    double factor = 1, uniform_K = 0;  ///< temperature = factor * model + uniform
    std::uint32_t count = 0;
    bool heard = false;
  };

  double displacement(const Nut& nut, double x_mm) const TRN_RT;
  void next_profile(Nut& nut, int channel) TRN_RT;
  void advance(std::size_t screw, const Way& way);
  bool read_sensor(std::size_t screw, const SensorBoard::Heard& sensor, double& rise_K);
  void use_temperatures(std::size_t screw, const SensorBoard::Heard& sensor);

  ScrewCorrectionConfig config_;
  const SensorBoard& board_;
  std::vector<Nut> nuts_;
  std::vector<Worker> workers_;
  std::vector<std::string> silent_texts_, absurd_texts_;
  std::atomic<const char*> warning_{""};
  double time_s_ = 0;
};

/// A table that describes a screw: joint, bearings, mounting and heat; not its sensor.
ScrewConfig read_screw(const Machine& machine, const ConfigTable& table);

/// Section [corrections.screw].
ScrewCorrectionConfig read_screws(const Machine& machine, const ConfigTable& section, SensorBoard& board);

}  // namespace trn
