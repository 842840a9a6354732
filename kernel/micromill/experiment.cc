#include "kernel/micromill/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

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
  Eigen::Vector2d difference = Eigen::Vector2d::Zero(), truth = difference;
  int in_block = 0;
  const int block = static_cast<int>(kAverageS / 0.001);
  for (const StageRow& row : run.rows) {
    if (!row.counts) continue;
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
                    const DeflectionCorrection::Config& config, const Eigen::Vector2d& share, Shape shape,
                    int cutter, bool draw) {
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
  if (draw) draw_part(options.pictures, shape, run);
  if (options.gain == 0) return part;
  DeflectionCorrection::Config corrected = config;
  corrected.gain = options.gain;
  for (int axis = 0; axis < 2; ++axis)
    corrected.estimator.axes[static_cast<std::size_t>(axis)].stiffness_N_mm /= share[axis];
  const StageRun again = lab.run(program, setup, &corrected);
  std::copy(again.size_mm, again.size_mm + 2, part.corrected_mm);
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

std::vector<PlantResult> run_experiment(const ExperimentOptions& options) {
  std::vector<PlantResult> plants;
  for (int i = 0; i < options.plants; ++i) {
    PlantResult plant;
    plant.seed = options.first_seed + static_cast<std::uint64_t>(i);
    const auto tell = [&](const std::string& what) {
      if (options.progress) options.progress(fmt::format("plant {} of {}: {}", i + 1, options.plants, what));
    };
    const bool draw = i == 0 && !options.pictures.empty();
    const StageLab lab(options.machine, plant.seed);
    tell("learns friction and ripple");
    plant.networks = train_stage(lab, lab.run(sine_program(), {}, nullptr),
                                 lab.run(validation_program(), {}, nullptr), options.training);
    if (draw) draw_validation(options.pictures, lab, plant.networks);
    tell("presses the tool");
    for (int axis = 0; axis < 2; ++axis) plant.stiffness[axis] = press(lab, plant.networks, axis);
    const Eigen::Vector2d stiffness(plant.stiffness[0].fit.stiffness_N_mm,
                                    plant.stiffness[1].fit.stiffness_N_mm);
    const DeflectionCorrection::Config config = learnt(lab, plant.networks, stiffness, 0);
    if (options.test_cut) plant.surface_share = surface_share(lab, config, 2 * options.parts);
    for (int part = 0; part < 2 * options.parts; ++part) {
      tell(fmt::format("cuts part {} of {}", part + 1, 2 * options.parts));
      const Shape shape = part < options.parts ? Shape::kRound : Shape::kSquare;
      plant.parts.push_back(cut_part(options, lab, config, plant.surface_share, shape, part,
                                     draw && (part == 0 || part == options.parts)));
    }
    plants.push_back(std::move(plant));
  }
  return plants;
}

ExperimentSummary summarize(const std::vector<PlantResult>& plants) {
  ExperimentSummary out;
  Mean round, square, round_pressed, square_pressed, explained, before, after, force;
  double reduction = std::numeric_limits<double>::infinity();
  for (const PlantResult& plant : plants) {
    for (const TrainingRecord& record : plant.networks.record) {
      explained.add(record.explained_validation);
      out.explained_worst = std::min(out.explained_worst, record.explained_validation);
    }
    Mean plant_before, plant_after;
    for (const PartResult& part : plant.parts) {
      const bool is_round = part.shape == Shape::kRound;
      for (int i = 0; i < part.sizes; ++i) {
        (is_round ? round : square).add(part.error_percent(i));
        (is_round ? round_pressed : square_pressed).add(part.pressed_error_percent(i));
        double& worst = is_round ? out.round_worst_percent : out.square_worst_percent;
        worst = std::max(worst, part.error_percent(i));
        plant_before.add(std::abs(part.measured_mm[i] - kPartSizeMm));
        plant_after.add(std::abs(part.corrected_mm[i] - kPartSizeMm));
        before.add(std::abs(part.measured_mm[i] - kPartSizeMm));
        after.add(std::abs(part.corrected_mm[i] - kPartSizeMm));
      }
      force.add(100 * part.force_error_N / part.force_N);
      out.unstable += part.stable ? 0 : 1;
      ++out.cuts;
    }
    reduction = std::min(reduction, plant_before.value() / plant_after.value());
  }
  out.round_percent = round.value();
  out.square_percent = square.value();
  out.round_pressed_percent = round_pressed.value();
  out.square_pressed_percent = square_pressed.value();
  out.explained_mean = explained.value();
  out.size_error_mm = before.value();
  out.corrected_error_mm = after.value();
  out.reduction_worst = reduction;
  out.force_error_percent = force.value();
  return out;
}

}  // namespace trn
