#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/lab/micromill/experiment.h"
#include "app/lab/micromill/stage_lab.h"
#include "app/session/corrections.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/micromill/friction_network.h"
#include "compensation/micromill/load_observer.h"
#include "compensation/offset_filter.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/units.h"
#include "kernel/setpoint_chain.h"
#include "sim/micromill/part_surface.h"

namespace trn {

namespace {

using Shape = PartSurface::Shape;

// docs/sources.md S5.6, table 4 of that paper.
constexpr double kPaperPredicted[] = {24.77, 24.80, 24.77, 24.76, 24.78};
constexpr double kPaperMeasured[] = {24.80, 24.82, 24.82, 24.80, 24.83};
constexpr double kPaperPercent[] = {18, 10, 29, 25, 28};
constexpr int kPaperParts = 5;

constexpr double kServoRadS = 250;  // of the simulated drives' position loop

std::string learning_text(const PlantResult& plant) {
  std::string out;
  const char* axes[] = {"X", "Y"};
  for (std::size_t i = 0; i < 2; ++i) {
    const TrainingRecord& r = plant.networks.record[i];
    const PressingResult& k = plant.stiffness[i];
    out += fmt::format(
        "  {}  friction and ripple explained: training {:.1f} %, unseen runs {:.1f} % (left {:.2f} N rms)   "
        "tool {:.1f} N/mm "
        "(true {:.1f})\n",
        axes[i], 100 * r.explained_training, 100 * r.explained_validation, r.rms_validation_N,
        k.fit.stiffness_N_mm, k.true_N_mm);
  }
  out += fmt::format(
      "  the finished surface shows {:.1f} % and {:.1f} % of the mean bending along X and Y (test cut)\n",
      100 * plant.surface_share.x(), 100 * plant.surface_share.y());
  return out;
}

std::string part_text(const PartResult& part, int number, bool corrected) {
  std::string out;
  for (int i = 0; i < part.sizes; ++i) {
    const bool round = part.shape == Shape::kRound;
    out += fmt::format("  {:<9} {:<4} {:<12.3f} {:<11.3f} {:<9.1f}",
                       round ? "round" : (i == 0 ? "square X" : "square Y"), number, part.predicted_mm[i],
                       part.measured_mm[i], part.error_percent(i));
    if (corrected) out += fmt::format(" {:<11.3f}", part.corrected_mm[i]);
    if (round && number <= kPaperParts)
      out += fmt::format(" {:<10.2f} {:<9.2f} {:.0f}", kPaperPredicted[number - 1],
                         kPaperMeasured[number - 1], kPaperPercent[number - 1]);
    out += "\n";
  }
  return out;
}

}  // namespace

std::string plant_text(const ExperimentOptions& options, const PlantResult& plant) {
  const bool corrected = options.gain > 0;
  std::string out = fmt::format("Plant {}\n", plant.seed) + learning_text(plant);
  out += fmt::format(
      "  part      no   predicted mm measured mm error %  {} paper: predicted, measured, error %\n",
      corrected ? "corrected  " : "");
  int round = 0, square = 0;
  for (const PartResult& part : plant.parts)
    out += part_text(part, part.shape == Shape::kRound ? ++round : ++square, corrected);
  return out;
}

namespace {

double smoothing_s(const StageLab& lab, const std::string& machine) {
  const Machine read = read_machine(load_config(machine));
  const ConfigTable section = read.root.table("corrections").table("deflection");
  const SetpointBudget budget = read_budget(section, "deflection");
  const JointLimit& limit = read.joints[0].limit;
  const double share = budget.reserve;
  return OffsetFilter(budget.limit_mm, share * limit.velocity, share * limit.acceleration, share * limit.jerk,
                      lab.nominal().period_s)
      .time_constant_s();
}

std::string margin_text(const ExperimentOptions& options) {
  const StageLab lab(options.machine, options.first_seed);
  DeflectionCorrection::Config config = lab.nominal();
  config.gain = options.gain;
  const double smoothing = smoothing_s(lab, options.machine);
  std::string out;
  for (const double process : {1.0, 0.5}) {
    const CorrectionMargins m = correction_margins(config, 0, smoothing, kServoRadS, process);
    const std::string phase = std::isinf(m.phase_margin_rad)
                                  ? "stable at any phase"
                                  : fmt::format("phase margin {:.1f} deg", m.phase_margin_rad * kDegPerRad);
    out += fmt::format(
        "  loop gain of the correction, when a deeper cut bends the tool by {:.1f} of its depth: {:.3f}, "
        "gain "
        "margin {:.2f}, {}\n",
        process, m.loop_gain_max, m.gain_margin, phase);
  }
  return out;
}

// Frequency at which the load filter passes 0.707 of a load, Hz.
double bandwidth_hz(const LoadObserver& observer) {
  double omega = 1;
  while (omega < 1e5 && std::abs(observer.load_response(omega)) > std::sqrt(0.5)) omega *= 1.001;
  return omega / (2 * kPi);
}

std::string error_line(const char* shape, const char* way, const ErrorFigures& error, double paper) {
  return fmt::format(
      "  deflection error, {:<6} {:<22} {:.1f} % (worst plant {:.1f} %, worst part {:.1f} %); paper {:.0f} "
      "%\n",
      shape, way, error.mean, error.worst_plant, error.worst_part, paper);
}

std::string error_text(const ExperimentOptions& options, const ExperimentSummary& s) {
  std::string out = error_line("round", "by the pressing test:", s.round_pressed, 22) +
                    error_line("square", "by the pressing test:", s.square_pressed, 17);
  if (options.test_cut)
    out += error_line("round", "with the test cut:", s.round, 22) +
           error_line("square", "with the test cut:", s.square, 17);
  return out;
}

std::string correction_text(const ExperimentOptions& options, const ExperimentSummary& s) {
  std::string out = fmt::format(
      "  size error                {:.4f} mm; with the path correction {:.4f} mm (worst {:.4f}): {:.1f} "
      "times "
      "less (worst plant {:.1f} times)\n",
      s.size_error_mm, s.corrected_error_mm, s.corrected_worst_mm, s.size_error_mm / s.corrected_error_mm,
      s.reduction_worst);
  out += fmt::format("  unstable with correction  {} of {} cuts\n", s.unstable, s.cuts);
  return out + margin_text(options);
}

}  // namespace

std::string summary_text(const ExperimentOptions& options, const std::vector<PlantResult>& plants) {
  const ExperimentSummary s = summarize(plants);
  const StageLab lab(options.machine, options.first_seed);
  std::string out = fmt::format("Mean over {} plants, {} parts\n", plants.size(), s.cuts);
  out += error_text(options, s);
  out += fmt::format("  friction and ripple explained on unseen runs  {:.1f} % (worst axis {:.1f} %)\n",
                     100 * s.explained_mean, 100 * s.explained_worst);
  out += fmt::format(
      "  tool stiffness by pressing  off by {:.1f} % (worst {:.1f} %); force while creeping off by {:.2f} N "
      "rms (worst {:.2f})\n",
      s.stiffness_percent, s.stiffness_worst_percent, s.pressed_force_error_N, s.pressed_force_worst_N);
  out += fmt::format(
      "  force along the contour   {:.1f} % rms of the true force (worst part {:.1f} %); filter's bandwidth "
      "X {:.0f} Hz, Y {:.0f} Hz\n",
      s.force_error_percent, s.force_worst_percent,
      bandwidth_hz(LoadObserver(lab.nominal().estimator.axes[0].observer)),
      bandwidth_hz(LoadObserver(lab.nominal().estimator.axes[1].observer)));
  out += fmt::format(
      "  alarms                    in {} of {} parts; innovation at most {:.1f} times the training's\n",
      s.alarms, s.cuts, s.innovation_ratio);
  return options.gain > 0 ? out + correction_text(options, s) : out;
}

namespace {

nlohmann::ordered_json figures_json(const ErrorFigures& error) {
  return {{"mean", error.mean}, {"worst_plant", error.worst_plant}, {"worst_part", error.worst_part}};
}

}  // namespace

std::string experiment_json(const ExperimentOptions& options, const std::vector<PlantResult>& plants) {
  using Json = nlohmann::ordered_json;
  const ExperimentSummary s = summarize(plants);
  Json out = {{"machine", options.machine},
              {"gain", options.gain},
              {"round_error_percent", figures_json(s.round)},
              {"square_error_percent", figures_json(s.square)},
              {"round_error_pressed_percent", figures_json(s.round_pressed)},
              {"square_error_pressed_percent", figures_json(s.square_pressed)},
              {"explained_mean", s.explained_mean},
              {"explained_worst", s.explained_worst},
              {"force_error_percent", s.force_error_percent},
              {"force_worst_percent", s.force_worst_percent},
              {"pressed_force_error_N", s.pressed_force_error_N},
              {"stiffness_percent", s.stiffness_percent},
              {"stiffness_worst_percent", s.stiffness_worst_percent},
              {"alarms", s.alarms},
              {"innovation_ratio", s.innovation_ratio},
              {"size_error_mm", s.size_error_mm},
              {"corrected_error_mm", s.corrected_error_mm},
              {"corrected_worst_mm", s.corrected_worst_mm},
              {"reduction_worst", s.reduction_worst},
              {"unstable", s.unstable},
              {"plants", Json::array()}};
  for (const PlantResult& plant : plants) {
    Json parts = Json::array();
    for (const PartResult& part : plant.parts)
      for (int i = 0; i < part.sizes; ++i)
        parts.push_back(
            {{"shape", part.shape == Shape::kRound ? "round" : (i == 0 ? "square_x" : "square_y")},
             {"predicted_mm", part.predicted_mm[i]},
             {"measured_mm", part.measured_mm[i]},
             {"predicted_by_pressing_mm", part.pressed_mm[i]},
             {"corrected_mm", part.corrected_mm[i]},
             {"error_percent", part.error_percent(i)},
             {"force_N", part.force_N},
             {"force_error_N", part.force_error_N},
             {"force_bias_N", part.bias_N},
             {"innovation_ratio", part.innovation_ratio},
             {"alarm", part.alarm},
             {"stable", part.stable}});
    Json axes = Json::array();
    for (std::size_t i = 0; i < 2; ++i)
      axes.push_back({{"explained_validation", plant.networks.record[i].explained_validation},
                      {"stiffness_N_mm", plant.stiffness[i].fit.stiffness_N_mm},
                      {"stiffness_true_N_mm", plant.stiffness[i].true_N_mm},
                      {"pressed_force_error_N", plant.stiffness[i].force_error_N},
                      {"surface_share", plant.surface_share[static_cast<Eigen::Index>(i)]}});
    out["plants"].push_back({{"seed", plant.seed}, {"axes", axes}, {"parts", parts}});
  }
  return out.dump(2) + "\n";
}

}  // namespace trn
