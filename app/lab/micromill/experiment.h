#pragma once

#include <functional>
#include <string>
#include <vector>

#include "app/lab/micromill/stage_lab.h"
#include "compensation/micromill/friction_network.h"
#include "sim/micromill/part_surface.h"

namespace trn {

/// One part of the experiment. Round parts have one size, square ones two (along X and Y); mm.
struct PartResult {
  PartSurface::Shape shape = PartSurface::Shape::kRound;
  int sizes = 1;
  double predicted_mm[2] = {0, 0}, measured_mm[2] = {0, 0};
  double pressed_mm[2] = {0, 0};    ///< predicted by the pressing test alone, without the test cut
  double corrected_mm[2] = {0, 0};  ///< measured after the same cut with the path correction
  double force_N = 0;               ///< true, mean magnitude along the contour
  double force_error_N = 0;         ///< root mean square of estimate less truth, both averaged over 0.25 s
  double bias_N = 0;                ///< magnitude of the same difference averaged over the whole contour
  bool stable = true;  ///< with the correction: no fault, in the limits, no larger bending than without
  bool alarm = false;  ///< in any period of the cuts
  double innovation_ratio = 0;  ///< largest mean innovation of the cuts, times that of the training runs

  /// Percent of the predicted deflection (docs/sources.md S5.6).
  double error_percent(int i) const;
  double pressed_error_percent(int i) const;
};

struct PlantResult {
  std::uint64_t seed = 0;
  StageNetworks networks;
  PressingResult stiffness[2];
  /// Share of the tool's mean bending that the finished surface shows, along X and Y; by the test cut.
  Eigen::Vector2d surface_share = Eigen::Vector2d::Ones();
  std::vector<PartResult> parts;
};

struct ExperimentOptions {
  std::string machine;
  std::uint64_t first_seed = 0;
  int plants = 1, parts = 5;  ///< parts of each shape
  double gain = 1;            ///< of the path correction in the second cut; 0: no second cut
  bool test_cut = true;       ///< one square part, not counted, is cut and measured first
  TrainChoice training;
  std::string pictures;  ///< folder; empty: none. Of the first plant.
  std::function<void(const std::string& doing, double done)> progress;  ///< done: share of the whole
  std::function<void(const PlantResult&)> finished;  ///< hears of every plant as it is done
};

/// A deflection error in percent, over all parts of all plants.
struct ErrorFigures {
  double mean = 0, worst_plant = 0, worst_part = 0;  ///< worst_plant: the largest mean over one plant's parts
};

/// What a mean over all plants and parts says.
struct ExperimentSummary {
  ErrorFigures round, square;                        ///< predicted with the test cut, if there was one
  ErrorFigures round_pressed, square_pressed;        ///< by the pressing test alone (docs/sources.md S5.5)
  double explained_worst = 1, explained_mean = 0;    ///< variance share on unseen runs
  double size_error_mm = 0, corrected_error_mm = 0;  ///< mean |measured - nominal|, without and with
  double reduction_worst = 0;                        ///< the smallest ratio of the two over the plants
  double corrected_worst_mm = 0;                     ///< the largest |measured - nominal| of one part
  double force_error_percent = 0, force_worst_percent = 0;      ///< along the contour; mean and worst part
  double pressed_force_error_N = 0, pressed_force_worst_N = 0;  ///< in the pressing test
  double stiffness_percent = 0, stiffness_worst_percent = 0;    ///< error of k_t
  double innovation_ratio = 0;                                  ///< largest of all parts
  int unstable = 0, alarms = 0, cuts = 0;                       ///< cuts: pairs, without and with correction
};

/// Trains, validates, presses and cuts on every plant (docs/sources.md S5).
std::vector<PlantResult> run_experiment(const ExperimentOptions& options);
ExperimentSummary summarize(const std::vector<PlantResult>& plants);

/// Sizes that the estimates of a run predict, when the surface shows `share` of the mean bending.
void predict_sizes(const StageRun& run, PartSurface::Shape shape, const Eigen::Vector2d& share,
                   double predicted_mm[2]);

/// Reports, for people (each plant, then what they have in common) and for programs.
std::string plant_text(const ExperimentOptions& options, const PlantResult& plant);
std::string summary_text(const ExperimentOptions& options, const std::vector<PlantResult>& plants);
std::string experiment_json(const ExperimentOptions& options, const std::vector<PlantResult>& plants);

/// Pictures of one plant, as SVG files in a folder that exists or is made.
void draw_validation(const std::string& folder, const StageLab& lab, const StageNetworks& networks);
void draw_part(const std::string& folder, PartSurface::Shape shape, const StageRun& run);

}  // namespace trn
