#include "app/lab/micromill/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/lab/micromill/programs.h"
#include "compensation/micromill/deflection_correction.h"
#include "core/fault.h"
#include "core/units.h"

namespace trn {

namespace {

using Shape = PartSurface::Shape;

constexpr double kAverageS = 0.25;

// Sums of a quantity along a feature.
struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) {
    sum += value;
    ++count;
  }
  double value() const { return count ? sum / count : 0.0; }
};

double round_deflection(const StageRun& run, const Eigen::Vector2d& share) {
  Mean mean;
  for (const StageRow& row : run.rows) {
    if (!row.counts) continue;
    const double from_mark = std::abs(std::abs(std::atan2(row.plan_mm.y(), row.plan_mm.x())) - kPi);
    if (from_mark >= PartSurface::kMarkRad)
      mean.add(row.deflection_mm.cwiseProduct(share).dot(row.plan_mm.normalized()));
  }
  return mean.value();
}

// Outward, on the side of the square at +-axis.
double side_deflection(const StageRun& run, int axis, double sign) {
  const double half = kPartSizeMm / 2;
  Mean mean;
  for (const StageRow& row : run.rows)
    if (row.counts && sign * row.plan_mm[axis] > half &&
        std::abs(row.plan_mm[1 - axis]) < PartSurface::kSideShare * half)
      mean.add(sign * row.deflection_mm[axis]);
  return mean.value();
}

void judge_force(const StageRun& run, PartResult& part) {
  Mean error, force;
  Eigen::Vector2d difference = Eigen::Vector2d::Zero(), truth = difference, all = difference;
  int in_block = 0, rows = 0;
  const int block = static_cast<int>(kAverageS / 0.001);
  for (const StageRow& row : run.rows) {
    if (!row.counts) continue;
    all += row.force_N - row.true_force_N;
    ++rows;
    difference += row.force_N - row.true_force_N;
    truth += row.true_force_N;
    if (++in_block < block) continue;
    error.add((difference / block).squaredNorm());
    force.add((truth / block).norm());
    difference = truth = Eigen::Vector2d::Zero();
    in_block = 0;
  }
  part.force_N = force.value();
  part.force_error_N = std::sqrt(error.value());
  part.bias_N = (all / rows).norm();
}

void judge_innovation(const StageRun& run, const StageNetworks& networks, PartResult& part) {
  for (const StageRow& row : run.rows) {
    part.alarm = part.alarm || row.alarm;
    for (Eigen::Index i = 0; i < 2; ++i)
      part.innovation_ratio =
          std::max(part.innovation_ratio,
                   row.innovation_rms_mm[i] / networks.record[static_cast<std::size_t>(i)].innovation_rms_mm);
  }
}

double largest_bending(const StageRun& run) {
  double largest = 0;
  for (const StageRow& row : run.rows) largest = std::max(largest, row.true_deflection_mm.norm());
  return largest;
}

// The pressing test tells the mean bending; the teeth leave the surface at one point of their turn, where the
// tool may be bent less or more. A part that is cut and measured once tells the share, as it does in a shop.
Eigen::Vector2d surface_share(const StageLab& lab, const DeflectionCorrection::Config& config, int cutter) {
  const StageRun run = lab.run(part_program(Shape::kSquare), {Shape::kSquare, cutter, false}, &config);
  double predicted_mm[2];
  predict_sizes(run, Shape::kSquare, Eigen::Vector2d::Ones(), predicted_mm);
  Eigen::Vector2d share;
  for (int axis = 0; axis < 2; ++axis)
    share[axis] = (run.size_mm[axis] - kPartSizeMm) / (predicted_mm[axis] - kPartSizeMm);
  return share;
}

PartResult cut_part(const ExperimentOptions& options, const StageLab& lab,
                    const DeflectionCorrection::Config& config, const PlantResult& plant, Shape shape,
                    int cutter, bool draw) {
  const Eigen::Vector2d& share = plant.surface_share;
  PartResult part;
  part.shape = shape;
  part.sizes = shape == Shape::kRound ? 1 : 2;
  const LabProgram program = part_program(shape);
  const StageSetup setup{shape, cutter, false};
  const StageRun run = lab.run(program, setup, &config);
  if (run.fault != Fault::kOk)
    throw std::runtime_error(fmt::format("a part could not be cut: {}", fault_info(run.fault).meaning));
  predict_sizes(run, shape, share, part.predicted_mm);
  predict_sizes(run, shape, Eigen::Vector2d::Ones(), part.pressed_mm);
  std::copy(run.size_mm, run.size_mm + 2, part.measured_mm);
  judge_force(run, part);
  judge_innovation(run, plant.networks, part);
  if (draw) draw_part(options.pictures, shape, run);
  if (options.gain == 0) return part;
  DeflectionCorrection::Config corrected = config;
  corrected.gain = options.gain;
  for (int axis = 0; axis < 2; ++axis)
    corrected.estimator.axes[static_cast<std::size_t>(axis)].stiffness_N_mm /= share[axis];
  const StageRun again = lab.run(program, setup, &corrected);
  std::copy(again.size_mm, again.size_mm + 2, part.corrected_mm);
  judge_innovation(again, plant.networks, part);
  part.stable =
      again.fault == Fault::kOk && again.within_limits && largest_bending(again) < 2 * largest_bending(run);
  return part;
}

}  // namespace

double PartResult::error_percent(int i) const {
  return 100 * std::abs(measured_mm[i] - predicted_mm[i]) / std::abs(predicted_mm[i] - kPartSizeMm);
}

double PartResult::pressed_error_percent(int i) const {
  return 100 * std::abs(measured_mm[i] - pressed_mm[i]) / std::abs(pressed_mm[i] - kPartSizeMm);
}

void predict_sizes(const StageRun& run, Shape shape, const Eigen::Vector2d& share, double predicted_mm[2]) {
  for (int axis = 0; axis < 2; ++axis)
    predicted_mm[axis] =
        kPartSizeMm + (shape == Shape::kRound
                           ? 2 * round_deflection(run, share)
                           : share[axis] * (side_deflection(run, axis, 1) + side_deflection(run, axis, -1)));
}

namespace {

/// Steps of a plant's experiment, by what they take: learning as much as so many parts.
constexpr int kLearningSteps = 6, kPressingSteps = 1;

PlantResult run_plant(const ExperimentOptions& options, std::uint64_t seed, bool draw,
                      const std::function<void(const std::string&, int)>& tell) {
  PlantResult plant;
  plant.seed = seed;
  const StageLab lab(options.machine, seed);
  tell("learns friction and ripple", 0);
  plant.networks = train_stage(lab, lab.run(sine_program(), {}, nullptr),
                               lab.run(validation_program(), {}, nullptr), options.training);
  if (draw) draw_validation(options.pictures, lab, plant.networks);
  tell("presses the tool", kLearningSteps);
  for (int axis = 0; axis < 2; ++axis) plant.stiffness[axis] = press(lab, plant.networks, axis);
  const Eigen::Vector2d stiffness(plant.stiffness[0].fit.stiffness_N_mm,
                                  plant.stiffness[1].fit.stiffness_N_mm);
  const DeflectionCorrection::Config config = learnt(lab, plant.networks, stiffness, 0);
  if (options.test_cut) plant.surface_share = surface_share(lab, config, 2 * options.parts);
  for (int part = 0; part < 2 * options.parts; ++part) {
    tell(fmt::format("cuts part {} of {}", part + 1, 2 * options.parts),
         kLearningSteps + kPressingSteps + part);
    const Shape shape = part < options.parts ? Shape::kRound : Shape::kSquare;
    plant.parts.push_back(
        cut_part(options, lab, config, plant, shape, part, draw && part % options.parts == 0));
  }
  return plant;
}

}  // namespace

std::vector<PlantResult> run_experiment(const ExperimentOptions& options) {
  std::vector<PlantResult> plants;
  const double steps = kLearningSteps + kPressingSteps + 2 * options.parts;
  for (int i = 0; i < options.plants; ++i) {
    const auto tell = [&](const std::string& what, int step) {
      if (options.progress)
        options.progress(fmt::format("stage {} of {}: {}", i + 1, options.plants, what),
                         (i + step / steps) / options.plants);
    };
    const bool draw = i == 0 && !options.pictures.empty();
    plants.push_back(run_plant(options, options.first_seed + static_cast<std::uint64_t>(i), draw, tell));
    if (options.finished) options.finished(plants.back());
  }
  return plants;
}

namespace {

/// One kind of deflection error over all plants.
ErrorFigures figures(const std::vector<PlantResult>& plants, Shape shape, bool pressed) {
  ErrorFigures out;
  Mean all;
  for (const PlantResult& plant : plants) {
    Mean mine;
    for (const PartResult& part : plant.parts) {
      for (int i = 0; i < part.sizes && part.shape == shape; ++i) {
        const double percent = pressed ? part.pressed_error_percent(i) : part.error_percent(i);
        all.add(percent);
        mine.add(percent);
        out.worst_part = std::max(out.worst_part, percent);
      }
    }
    out.worst_plant = std::max(out.worst_plant, mine.value());
  }
  out.mean = all.value();
  return out;
}

void sum_up_preparation(const std::vector<PlantResult>& plants, ExperimentSummary& out) {
  Mean explained, stiffness, force;
  for (const PlantResult& plant : plants) {
    for (const TrainingRecord& record : plant.networks.record) {
      explained.add(record.explained_validation);
      out.explained_worst = std::min(out.explained_worst, record.explained_validation);
    }
    for (const PressingResult& pressed : plant.stiffness) {
      const double percent = 100 * std::abs(pressed.fit.stiffness_N_mm / pressed.true_N_mm - 1);
      stiffness.add(percent);
      out.stiffness_worst_percent = std::max(out.stiffness_worst_percent, percent);
      force.add(pressed.force_error_N);
      out.pressed_force_worst_N = std::max(out.pressed_force_worst_N, pressed.force_error_N);
    }
  }
  out.explained_mean = explained.value();
  out.stiffness_percent = stiffness.value();
  out.pressed_force_error_N = force.value();
}

void sum_up_part(const PartResult& part, ExperimentSummary& out) {
  out.unstable += part.stable ? 0 : 1;
  out.alarms += part.alarm ? 1 : 0;
  out.innovation_ratio = std::max(out.innovation_ratio, part.innovation_ratio);
  out.force_worst_percent = std::max(out.force_worst_percent, 100 * part.force_error_N / part.force_N);
  ++out.cuts;
}

}  // namespace

ExperimentSummary summarize(const std::vector<PlantResult>& plants) {
  ExperimentSummary out;
  sum_up_preparation(plants, out);
  out.round = figures(plants, Shape::kRound, false);
  out.square = figures(plants, Shape::kSquare, false);
  out.round_pressed = figures(plants, Shape::kRound, true);
  out.square_pressed = figures(plants, Shape::kSquare, true);
  Mean before, after, force;
  out.reduction_worst = std::numeric_limits<double>::infinity();
  for (const PlantResult& plant : plants) {
    Mean plant_before, plant_after;
    for (const PartResult& part : plant.parts) {
      for (int i = 0; i < part.sizes; ++i) {
        const double left_mm = std::abs(part.corrected_mm[i] - kPartSizeMm);
        for (Mean* mean : {&before, &plant_before}) mean->add(std::abs(part.measured_mm[i] - kPartSizeMm));
        for (Mean* mean : {&after, &plant_after}) mean->add(left_mm);
        out.corrected_worst_mm = std::max(out.corrected_worst_mm, left_mm);
      }
      force.add(100 * part.force_error_N / part.force_N);
      sum_up_part(part, out);
    }
    out.reduction_worst = std::min(out.reduction_worst, plant_before.value() / plant_after.value());
  }
  out.size_error_mm = before.value();
  out.corrected_error_mm = after.value();
  out.force_error_percent = force.value();
  return out;
}

}  // namespace trn
