#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "kernel/micromill/experiment.h"
#include "kernel/trace.h"
#include "tests/kernel/machine_run.h"

// The micro-mill's experiment through the whole kernel, on simulated stages whose friction, ripple, mass and
// cutter no number of the estimator was chosen with. TRN_LONG=20 (or more) cuts five parts of each shape
// on 20.
namespace trn::test {
namespace {

int plants_wanted() {
  const char* count = std::getenv("TRN_LONG");
  return count ? std::clamp(std::atoi(count), 1, 20) : 0;
}

ExperimentOptions experiment_options() {
  ExperimentOptions out;
  out.machine = config_of("micro_stage");
  out.first_seed = 500;
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
  EXPECT_LT(summary.round_percent, 22);  // the paper's own error
  EXPECT_LT(summary.square_percent, 17);
  EXPECT_GT(summary.size_error_mm, 3 * summary.corrected_error_mm);
  EXPECT_EQ(summary.unstable, 0);
  if (plants_wanted() < 20) return;
  EXPECT_LT(summary.round_percent, 11);
  EXPECT_LT(summary.square_percent, 8.5);
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

}  // namespace
}  // namespace trn::test
