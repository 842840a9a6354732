#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "compensation/offset_filter.h"
#include "core/units.h"
#include "kernel/corrections.h"
#include "kernel/micromill/experiment.h"

namespace trn {

namespace {

using Shape = PartSurface::Shape;

// spec.md section 5, the paper's table 4.
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

std::string plant_text(const PlantResult& plant, bool corrected) {
  std::string out = fmt::format("Plant {}\n", plant.seed) + learning_text(plant);
  out += fmt::format(
      "  part      no   predicted mm measured mm error %  {} paper: predicted, measured, error %\n",
      corrected ? "corrected  " : "");
  int round = 0, square = 0;
  for (const PartResult& part : plant.parts)
    out += part_text(part, part.shape == Shape::kRound ? ++round : ++square, corrected);
  return out;
}

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
    out += fmt::format(
        "  loop gain of the correction, when a deeper cut bends the tool by {:.1f} of its depth: {:.2f}, "
        "gain margin {:.2f}\n",
        process, m.loop_gain_max, m.gain_margin);
  }
  return out;
}

// Frequency at which the load filter passes 0.707 of a load, Hz.
double bandwidth_hz(const LoadObserver& observer) {
  double omega = 1;
  while (omega < 1e5 && std::abs(observer.load_response(omega)) > std::sqrt(0.5)) omega *= 1.001;
  return omega / (2 * kPi);
}

}  // namespace

std::string experiment_text(const ExperimentOptions& options, const std::vector<PlantResult>& plants) {
  const bool corrected = options.gain > 0;
  std::string out;
  for (const PlantResult& plant : plants) out += plant_text(plant, corrected);
  const ExperimentSummary s = summarize(plants);
  const StageLab lab(options.machine, options.first_seed);
  out += fmt::format("Mean over {} plants, {} cuts\n", plants.size(), s.cuts);
  const auto line = [](const char* shape, double mean, double worst, double pressed, double paper) {
    return fmt::format(
        "  deflection error, {:<7} {:.1f} % (worst part {:.1f} %); by the pressing test alone {:.1f} %; "
        "paper "
        "{:.0f} %\n",
        shape, mean, worst, pressed, paper);
  };
  out += line("round", s.round_percent, s.round_worst_percent, s.round_pressed_percent, 22);
  out += line("square", s.square_percent, s.square_worst_percent, s.square_pressed_percent, 17);
  out += fmt::format("  friction and ripple explained on unseen runs  {:.1f} % (worst axis {:.1f} %)\n",
                     100 * s.explained_mean, 100 * s.explained_worst);
  out += fmt::format(
      "  force along the contour   {:.1f} % rms of the true force; filter's bandwidth X {:.0f} Hz, Y {:.0f} "
      "Hz\n",
      s.force_error_percent, bandwidth_hz(LoadObserver(lab.nominal().estimator.axes[0].observer)),
      bandwidth_hz(LoadObserver(lab.nominal().estimator.axes[1].observer)));
  if (!corrected) return out;
  out += fmt::format(
      "  size error                {:.4f} mm; with the path correction {:.4f} mm: {:.1f} times less (worst "
      "plant {:.1f} times)\n",
      s.size_error_mm, s.corrected_error_mm, s.size_error_mm / s.corrected_error_mm, s.reduction_worst);
  out += fmt::format("  unstable with correction  {} of {} cuts\n", s.unstable, s.cuts);
  return out + margin_text(options);
}

std::string experiment_json(const ExperimentOptions& options, const std::vector<PlantResult>& plants) {
  using Json = nlohmann::ordered_json;
  const ExperimentSummary s = summarize(plants);
  Json out = {{"machine", options.machine},
              {"gain", options.gain},
              {"round_error_percent", s.round_percent},
              {"square_error_percent", s.square_percent},
              {"round_error_pressed_percent", s.round_pressed_percent},
              {"square_error_pressed_percent", s.square_pressed_percent},
              {"round_worst_percent", s.round_worst_percent},
              {"square_worst_percent", s.square_worst_percent},
              {"explained_mean", s.explained_mean},
              {"explained_worst", s.explained_worst},
              {"force_error_percent", s.force_error_percent},
              {"size_error_mm", s.size_error_mm},
              {"corrected_error_mm", s.corrected_error_mm},
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
             {"stable", part.stable}});
    Json axes = Json::array();
    for (std::size_t i = 0; i < 2; ++i)
      axes.push_back({{"explained_validation", plant.networks.record[i].explained_validation},
                      {"stiffness_N_mm", plant.stiffness[i].fit.stiffness_N_mm},
                      {"stiffness_true_N_mm", plant.stiffness[i].true_N_mm}});
    out["plants"].push_back({{"seed", plant.seed}, {"axes", axes}, {"parts", parts}});
  }
  return out.dump(2) + "\n";
}

}  // namespace trn
