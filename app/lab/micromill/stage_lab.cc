#include "app/lab/micromill/stage_lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "compensation/micromill/deflection_estimator.h"
#include "core/config.h"
#include "core/machine.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"
#include "sim/micromill/micro_mill_drives.h"

namespace trn {

namespace {

/// Notes every period of a run.
class Recorder final : public ReportSink {
 public:
  Recorder(MicroMillPlant& plant, const DeflectionCorrection& correction, const LabProgram& program,
           std::vector<StageRow>& rows)
      : plant_(plant), correction_(correction), program_(program), rows_(rows) {}

  void write(const CycleReport& report) override {
    StageRow row;
    row.plan_mm = report.q_plan.head<2>();
    row.setpoint_mm = report.q_setpoint.head<2>();
    row.measured_mm = report.q_measured.head<2>();
    row.current_A = report.current_A.head<2>();
    const DeflectionEstimator::Output& estimate = correction_.estimate();
    row.load_N = estimate.load_N;
    row.friction_N = estimate.friction_N;
    row.force_N = estimate.force_N;
    row.deflection_mm = estimate.deflection_mm;
    row.innovation_rms_mm = estimate.innovation_rms_mm;
    row.alarm = estimate.alarm;
    row.true_force_N = plant_.tool_force_N();
    row.true_disturbance_N = plant_.disturbance_N();
    row.true_deflection_mm = plant_.deflection_mm();
    row.line = report.line;
    const auto& lines = program_.lines;
    row.counts = std::find(lines.begin(), lines.end(), row.line) != lines.end();
    rows_.push_back(row);
  }

 private:
  MicroMillPlant& plant_;
  const DeflectionCorrection& correction_;
  const LabProgram& program_;
  std::vector<StageRow>& rows_;
};

ConfigTable deflection_section(const ConfigTable& root) {
  return root.table("corrections").table("deflection");
}

/// The chain with nothing but this correction in it; it stays the chain's.
const DeflectionCorrection* put_correction(Assembly& assembly, const DeflectionCorrection::Config& config) {
  SetpointBudget budget = read_budget(deflection_section(assembly.machine.root), "deflection");
  budget.enabled = true;
  auto correction = std::make_unique<DeflectionCorrection>(config);
  const DeflectionCorrection* made = correction.get();
  auto& chain = assembly.corrections.setpoint;
  chain = std::make_unique<SetpointChain>(assembly.machine.joints, assembly.machine.period_s);
  chain->append(budget, std::move(correction));
  assembly.plan_joints = chain->plan_joints();
  return made;
}

DeflectionCorrection::Config untrained(DeflectionCorrection::Config config) {
  config.trained = false;
  config.gain = 0;
  for (DeflectionEstimator::Axis& axis : config.estimator.axes) {
    axis.network = FrictionNetwork();
    axis.innovation_rms_max_mm = std::numeric_limits<double>::infinity();
  }
  return config;
}

}  // namespace

StageLab::StageLab(std::string config_path, std::optional<std::uint64_t> seed)
    : config_path_(std::move(config_path)) {
  const Machine machine = read_machine(load_config(config_path_));
  const auto drives = machine.root.table("drives");
  seed_ = seed ? *seed : static_cast<std::uint64_t>(drives.integer("seed", 0, Range{0, 1e9}));
  plant_ = micro_mill_plant(seed_, machine.period_s);
  nominal_ = read_deflection(deflection_section(machine.root), machine.period_s);
}

StageRun StageLab::run(const LabProgram& program, const StageSetup& setup,
                       const DeflectionCorrection::Config* correction) const {
  Assembly assembly = assemble(config_path_);
  MicroMillDrives::Config config;
  config.plant = plant_;
  config.plant.cutter = another_cutter(plant_, seed_, setup.cutter);
  if (setup.part) config.part.emplace(PartSurface::Config{*setup.part});
  auto drives = std::make_unique<MicroMillDrives>(config);
  MicroMillPlant& plant = drives->plant();
  plant.set_block(setup.block);
  assembly.drives = std::move(drives);
  const DeflectionCorrection* made = put_correction(assembly, correction ? *correction : untrained(nominal_));

  StageRun out;
  Recorder recorder(plant, *made, program, out.rows);
  Parameters parameters;
  ToolTable tools;
  SimulationOptions options;
  options.program = "micro-mill";
  options.program_text = program.text;
  options.trace = &recorder;
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  out.fault = result.fault;
  out.within_limits = result.within_limits;
  if (const auto& part = plant.part()) {
    out.surface_mm = part->distances_mm();
    const bool round = *setup.part == PartSurface::Shape::kRound;
    for (int axis = 0; axis < 2; ++axis)
      out.size_mm[axis] = round ? part->diameter_mm() : part->width_mm(axis);
  }
  return out;
}

TrainingSet training_set(const StageRun& run, const LoadObserver::Config& observer,
                         const DelayLine::Config& line, int axis, int stride, double* innovation_rms_mm) {
  const LoadObserver filter(observer);
  LoadObserver::State state;
  DelayLine::State delays;
  DelayLine::Taps taps;
  std::vector<double> inputs, targets;
  double sum = 0;
  int count = 0, since = 0;
  for (const StageRow& row : run.rows) {
    const double position_mm = row.measured_mm[axis];
    filter.step(row.current_A[axis], position_mm, state);
    DelayLine::step(position_mm, delays);
    since = row.counts ? since + 1 : 0;
    if (since <= line.delays * line.spacing) continue;  // taps of what came before, a rapid move
    sum += state.innovation_mm * state.innovation_mm;
    if (count++ % stride != 0) continue;
    DelayLine::read(line, position_mm, delays, taps);
    inputs.insert(inputs.end(), taps.data(), taps.data() + taps.size());
    targets.push_back(state.estimate[2]);
  }
  const auto n = static_cast<Eigen::Index>(targets.size());
  TrainingSet set;
  set.taps = Eigen::Map<const Eigen::MatrixXd>(inputs.data(), line.delays + 1, n);
  set.force_N = Eigen::Map<const Eigen::VectorXd>(targets.data(), n);
  if (innovation_rms_mm) *innovation_rms_mm = std::sqrt(sum / std::max(count, 1));
  return set;
}

StageNetworks train_stage(const StageLab& lab, const StageRun& sines, const StageRun& validation,
                          const TrainChoice& choice) {
  constexpr int kStrideMost = 40, kStrideJudged = 10, kSamplesPerWeight = 12;
  const auto rows =
      std::count_if(sines.rows.begin(), sines.rows.end(), [](const auto& r) { return r.counts; });
  const auto fits = static_cast<int>(rows) / (kSamplesPerWeight * choice.shape.weight_count());
  const int stride = std::clamp(fits, 4, kStrideMost);  // large networks want more samples
  StageNetworks out;
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const LoadObserver::Config& observer = lab.nominal().estimator.axes[i].observer;
    const DelayLine::Config& line = choice.shape.line;
    double innovation_mm = 0;
    const TrainingSet data = training_set(sines, observer, line, axis, stride, &innovation_mm);
    // Starts are compared on other samples of the same sines; the validation runs stay unseen.
    const TrainingSet others = training_set(sines, observer, line, axis, stride - 3);
    out.network[i] = train_network(choice.shape, data, others, choice.options, out.record[i]);
    const NetworkError unseen =
        network_error(out.network[i], training_set(validation, observer, line, axis, kStrideJudged));
    out.record[i].data = fmt::format(
        "sines by the kernel on the simulated stage {}; validation on other sines and on ramps", lab.seed());
    out.record[i].rms_validation_N = unseen.rms_N;
    out.record[i].explained_validation = unseen.explained;
    out.record[i].innovation_rms_mm = innovation_mm;
  }
  return out;
}

DeflectionCorrection::Config learnt(const StageLab& lab, const StageNetworks& networks,
                                    const Eigen::Vector2d& stiffness_N_mm, double gain) {
  DeflectionCorrection::Config config = lab.nominal();
  config.trained = true;
  config.gain = gain;
  for (std::size_t i = 0; i < 2; ++i) {
    DeflectionEstimator::Axis& axis = config.estimator.axes[i];
    axis.network = networks.network[i];
    axis.stiffness_N_mm = stiffness_N_mm[static_cast<Eigen::Index>(i)];
    axis.innovation_rms_max_mm = kInnovationAlarm * networks.record[i].innovation_rms_mm;
  }
  return config;
}

PressingResult press(const StageLab& lab, const StageNetworks& networks, int axis) {
  const double block_mm = lab.plant().block_mm[static_cast<std::size_t>(axis)];
  constexpr double kDepthMm = 0.12, kAfterContactMm = 0.015, kBeforeEndMm = 0.005;
  const DeflectionCorrection::Config config = learnt(lab, networks, {1, 1}, 0);
  const StageRun run = lab.run(pressing_program(axis, block_mm, kDepthMm), {{}, 0, true}, &config);
  std::vector<double> position_mm, force_N;
  double error = 0;
  for (const StageRow& row : run.rows) {
    const double x = row.measured_mm[axis];
    if (!row.counts || x < block_mm + kAfterContactMm || x > block_mm + kDepthMm - kBeforeEndMm) continue;
    position_mm.push_back(x);
    force_N.push_back(-row.force_N[axis]);
    error += std::pow(row.force_N[axis] - row.true_force_N[axis], 2);
  }
  const double n = static_cast<double>(force_N.size());
  return {fit_stiffness(position_mm, force_N), lab.plant().cutter.stiffness_N_mm[axis], std::sqrt(error / n)};
}

}  // namespace trn
