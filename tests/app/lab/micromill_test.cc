#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "app/daemon/planner_thread.h"
#include "app/daemon/telemetry.h"
#include "app/lab/micromill/experiment.h"
#include "app/lab/micromill/programs.h"
#include "app/lab/micromill/stage_lab.h"
#include "app/session/assembly.h"
#include "app/session/feature_recorder.h"
#include "app/session/make_cycle.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "app/session/trace.h"
#include "compensation/fit/network_training.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/micromill/friction_network.h"
#include "core/fault.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "sim/micromill/guide_friction.h"
#include "sim/micromill/linear_motor_axis.h"
#include "sim/micromill/micro_mill_plant.h"
#include "sim/micromill/part_surface.h"
#include "tests/app/session/machine_run.h"
#include "tests/support/rounds.h"

// The micro-mill's experiment through the whole kernel, on simulated stages whose friction, ripple, mass and
// cutter no number of the estimator was chosen with. TRN_LONG=20 (or more) cuts five parts of each shape
// on 20.
namespace trn::test {
namespace {

int plants_wanted() { return static_cast<int>(std::clamp(test::long_form().value_or(0), 0l, 20l)); }

ExperimentOptions experiment_options() {
  ExperimentOptions out;
  out.machine = config_of("micro_stage");
  out.first_seed = 100;
  const bool full = plants_wanted() > 0;
  out.plants = full ? plants_wanted() : 1;
  out.parts = full ? 5 : 1;
  out.training.options.starts = full ? 3 : 1;
  out.training.options.iterations_max = full ? 120 : 30;
  return out;
}

TEST(MicroMillExperiment, PredictsAndCorrectsWhatTheToolsBendingDoes) {
  const std::vector<PlantResult> plants = run_experiment(experiment_options());
  const ExperimentSummary summary = summarize(plants);
  EXPECT_GT(summary.explained_mean, 0.95);
  EXPECT_LT(summary.round.mean, 22);  // docs/sources.md S5.6
  EXPECT_LT(summary.square.mean, 17);
  EXPECT_GT(summary.size_error_mm, 3 * summary.corrected_error_mm);
  EXPECT_EQ(summary.unstable, 0);
  EXPECT_EQ(summary.alarms, 0);
  if (plants_wanted() < 20) return;
  EXPECT_LT(summary.round.mean, 11);
  EXPECT_LT(summary.square.mean, 8.5);
  for (const PlantResult& plant : plants)
    for (const PressingResult& pressed : plant.stiffness)
      EXPECT_NEAR(pressed.fit.stiffness_N_mm / pressed.true_N_mm, 1, 0.1) << plant.seed;
}

// `run` drives the stage's own motors, and tells the tool's load in the trace and of every feature.
TEST(MicroStage, ReportsTheBendingOfACircle) {
  Assembly assembly = assemble(config_of("micro_stage"));
  ASSERT_NE(assembly.corrections.setpoint->deflection(), nullptr);
  const std::string path = testing::TempDir() + "/micro_stage_trace.csv";
  Parameters parameters;
  ToolTable tools;
  SimulationResult result;
  {
    TraceWriter trace(path, assembly.machine, *assembly.map, *assembly.corrections.setpoint);
    SimulationOptions options;
    options.program = "circle";
    options.program_text = "G21 G90 G17 G64 P0.002\nG0 Z1\nG0 X-3\nG2 X-3 I3 J0 F300\nM2\n";
    options.trace = &trace;
    result = simulate(assembly, parameters, tools, options);
    trace.close();
  }
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  ASSERT_EQ(result.features.size(), 1u);
  EXPECT_EQ(result.features[0].line, 4u);
  EXPECT_NEAR(result.features[0].size_mm, 6, 1e-9);
  EXPECT_NEAR(result.features[0].bending_mm, 0, 0.02);  // nothing is cut: friction's rest over 50 N/mm
  std::ifstream file(path);
  std::string header, row, last;
  std::getline(file, header);
  EXPECT_NE(header.find(",line,force.X,force.Y,deflection.X,deflection.Y,load_known"), std::string::npos);
  while (std::getline(file, row)) last = row;
  EXPECT_EQ(last.back(), '1');  // known: the shipped config names what was learnt
}

/// The shipped stage, with what was learnt on it.
struct ShippedStage {
  StageLab lab{config_of("micro_stage")};
  StageNetworks networks = read_networks(source_dir() + "/configs/networks/micro_stage.toml");

  DeflectionCorrection::Config correction(double gain) const {
    return learnt(lab, networks, lab.plant().cutter.stiffness_N_mm, gain);
  }
  double innovation_ratio(const StageRun& run) const {
    double worst = 0;
    for (const StageRow& row : run.rows)
      for (std::size_t i = 0; i < 2; ++i)
        worst = std::max(worst, row.innovation_rms_mm[static_cast<Eigen::Index>(i)] /
                                    networks.record[i].innovation_rms_mm);
    return worst;
  }
};

// Pressed against a rigid block the tool bends by all of what the path moves: the stiffest process there is.
// Below gain 1 the shift stays within the sum of the geometric series for the depth and the estimate's own
// error (at rest friction's direction is unknown, and the shift hunts); above, it runs into its limit.
TEST(MicroStage, TheCorrectionIsStableUpToItsMargin) {
  constexpr double kDepthMm = 0.03, kLimitMm = 0.2;
  const ShippedStage stage;
  const double block_mm = stage.lab.plant().block_mm[0];
  LabProgram program;
  program.text = fmt::format("G21 G90 G64 P0.002\nG0 Z5\nG0 X{:.4f}\nG1 X{:.4f} F6\nG4 P6\nM2\n",
                             block_mm - 0.2, block_mm + kDepthMm);
  for (const double gain : {0.5, 0.7, 1.15}) {
    const DeflectionCorrection::Config config = stage.correction(gain);
    const StageRun run = stage.lab.run(program, {{}, 0, true}, &config);
    ASSERT_EQ(run.fault, Fault::kOk);
    EXPECT_TRUE(run.within_limits);
    double shift_mm = 0, error_mm = 0;
    for (const StageRow& row : run.rows) {
      shift_mm = std::max(shift_mm, row.setpoint_mm.x() - row.plan_mm.x());
      error_mm = std::max(error_mm, std::abs(row.deflection_mm.x() - row.true_deflection_mm.x()));
    }
    const CorrectionMargins margins = correction_margins(config, 0, 0, 1e6, 1);
    if (gain < 1) {
      EXPECT_GT(margins.gain_margin, 1);
      EXPECT_LT(shift_mm, gain / (1 - gain) * (kDepthMm + error_mm));
      EXPECT_GT(shift_mm, gain * kDepthMm);
    } else {
      EXPECT_LT(margins.gain_margin, 1);
      EXPECT_NEAR(shift_mm, kLimitMm, 1e-3);
    }
  }
}

// The shipped networks are of the shipped stage, and know of it what their record says.
TEST(MicroStage, TheShippedNetworksKnowTheShippedStage) {
  const ShippedStage stage;
  const StageRun run = stage.lab.run(validation_program(), {}, nullptr);
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const FrictionNetwork& network = stage.networks.network[i];
    const TrainingSet set =
        training_set(run, stage.lab.nominal().estimator.axes[i].observer, network.shape().line, axis, 10);
    const double explained = network_error(network, set).explained;
    EXPECT_GT(explained, 0.98);
    // The same run again, but for how the planner of the day moves it.
    EXPECT_NEAR(explained, stage.networks.record[i].explained_validation, 2e-3);
  }
}

/// What can become of a stage.
struct Change {
  const char* what;
  bool alarm;
  std::function<void(LinearMotorAxis::Config&)> change;
};

void rub_twice(LinearMotorAxis::Config& axis) {
  GuideFriction::Config& f = axis.friction;
  for (double* level : {&f.coulomb_up_N, &f.coulomb_down_N, &f.static_up_N, &f.static_down_N}) *level *= 2;
}

// The alarm speaks up where current and position do not go together as they did. It is quiet on the stage
// that was learnt; what only loads the motors in another way is load to the filter, and no filter can tell.
TEST(MicroStage, TheAlarmTellsAWrongModel) {
  using Axis = LinearMotorAxis::Config;
  const Change changes[] = {
      {"nothing", false, [](Axis&) {}},
      {"5 % more mass", false, [](Axis& axis) { axis.mass_kg *= 1.05; }},
      {"twice the friction", false, rub_twice},
      {"half the mass more", true, [](Axis& axis) { axis.mass_kg *= 1.5; }},
      {"a third of the motor's force gone", true, [](Axis& axis) { axis.force_N_A *= 0.67; }},
      {"an encoder that trembles by 1 um", true, [](Axis& axis) { axis.encoder_noise_mm = 0.001; }},
  };
  for (const Change& change : changes) {
    ShippedStage stage;
    MicroMillPlant::Config plant = stage.lab.plant();
    for (LinearMotorAxis::Config& axis : plant.axes) change.change(axis);
    stage.lab.change_plant(plant);
    const DeflectionCorrection::Config config = stage.correction(0);
    const auto shape = PartSurface::Shape::kRound;
    const StageRun run = stage.lab.run(part_program(shape), {shape, 0, false}, &config);
    const bool alarm =
        std::any_of(run.rows.begin(), run.rows.end(), [](const StageRow& row) { return row.alarm; });
    EXPECT_EQ(alarm, change.alarm) << change.what << ": innovation " << stage.innovation_ratio(run);
  }
}

/// Counts the periods in which the load filter's model did not fit.
class AlarmCounter : public ReportSink {
 public:
  void write(const CycleReport& report) override { alarms += report.tool_load.alarm ? 1 : 0; }
  int alarms = 0;
};

// A rapid move through the plate, and the same move above it: only the crash raises the alarm.
TEST(MicroStage, ACrashRaisesTheAlarm) {
  for (const bool crash : {false, true}) {
    Assembly assembly = assemble(config_of("micro_stage"));
    Parameters parameters;
    ToolTable tools;
    AlarmCounter counter;
    SimulationOptions options;
    options.program = "crash";
    options.program_text = fmt::format("G21 G90 G17\nG1 F60 Z{}\nG0 X15\nG0 X0\nM2\n", crash ? -0.3 : 0.3);
    options.trace = &counter;
    simulate(assembly, parameters, tools, options);
    EXPECT_EQ(counter.alarms > 0, crash) << counter.alarms;
  }
}

// As the daemon has it: the planner in its thread, the tick here, a recorder that both know. Status and
// session log tell every feature when the program ends, as `run` does.
TEST(MicroStage, StatusAndSessionLogTellThePredictedDiameter) {
  const Assembly assembly = assemble(config_of("micro_stage"));
  const std::string program = testing::TempDir() + "/features.ngc",
                    path = testing::TempDir() + "/features.log";
  std::ofstream(program) << "G21 G90 G17 G64 P0.002 F300\nG0 Z1\nG0 X-3\nG2 X-3 I3 J0\nG1 X-1\nM2\n";
  FeatureRecorder recorder;
  int ended = 0;
  {
    MotionQueue queue(8192);
    Cycle cycle =
        make_cycle(assembly, queue, ProgramStops::kWait, *assembly.drives, nullptr, *assembly.rate_plans);
    SessionLog log(path, {config_of("micro_stage"), "", ""});
    PlannerThread planner(assembly, queue, {}, {}, planner_listeners(&log, &recorder));
    const auto tick = [&] {
      cycle.tick();
      log.report(cycle.last_report());
      if (!recorder.report(cycle.last_report())) return;
      ++ended;
      log.features(recorder.last());
    };
    assembly.drives->bring_up();
    while (cycle.last_report().drives != DriveState::kEnabled) tick();
    for (int run = 0; run < 2; ++run) {  // the second time counts by itself
      planner.load(program, cycle.last_report().q_plan);
      EXPECT_EQ(recorder.last().empty(), run == 0);
      cycle.post({RtCommand::Kind::kStart});
      do tick();
      while (cycle.last_report().motion != MotionState::kRest);
    }
  }
  EXPECT_EQ(ended, 2);
  trunnion::status_t status{};
  add_features(recorder.last(), status);
  ASSERT_EQ(status.feature_count, 2);
  EXPECT_EQ(status.feature_line[0], 4);
  EXPECT_TRUE(status.feature_circle[0]);
  EXPECT_NEAR(status.feature_size_mm[0], 6, 1e-9);
  EXPECT_NEAR(status.feature_predicted_mm[0], 6 + 2 * status.feature_offset_mm[0], 1e-12);
  EXPECT_NEAR(status.feature_size_mm[1], 2, 1e-9);
  const Session session = read_session(path);
  std::vector<SessionEntry> told;
  for (const SessionEntry& entry : session.entries)
    if (entry.kind == SessionEntry::Kind::kFeatures) told.push_back(entry);
  ASSERT_EQ(told.size(), 2u);
  ASSERT_EQ(told[1].features.size(), 2u);
  EXPECT_EQ(told[1].features[0].predicted_mm(), recorder.last()[0].predicted_mm());
  EXPECT_EQ(features_of(status)[0].bending_mm, recorder.last()[0].bending_mm);
}

}  // namespace
}  // namespace trn::test
