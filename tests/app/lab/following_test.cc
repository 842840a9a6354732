#include "app/lab/following.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/config.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// What feed-forward is worth on a whole machine: interpreter, planner, tick, bus and emulated drives that
// weigh and rub.
namespace trn {
namespace {

const std::string kMachine = source_dir() + "/configs/cradle_servo.toml";
// Five axes at once, corners, reversals and rapids; seconds of the impeller's hours.
const std::string kText =
    "G21 G90 G64 P0.02 Q0.1\nG0 X20 Y-10 Z40 A0 C0\nM428\nG1 F4000 X0 Y10 Z10 A15 C20\nX30 Y15 A25 C60\n"
    "X10 Y-20 Z15 A-10 C90\nX-30 Y0 Z5 A5 C40\nX0 Y0 Z10 A0 C0\nM429\nG0 X-50 Y40 Z60 A-30 C-120\nG0 X0 Y0 "
    "Z0 A0 "
    "C0\nM2\n";

std::string program() {
  const std::string path = testing::TempDir() + "/following.ngc";
  std::ofstream(path) << kText;
  return path;
}

TEST(Following, FeedForwardMakesTheErrorsTenTimesSmaller) {
  const auto make = [] { return assemble(kMachine); };
  const std::vector<FollowingRun> runs = run_following(make, program(), "");
  const Machine machine = make().machine;
  std::printf("%s", following_table(runs, machine).c_str());
  ASSERT_EQ(runs.size(), 3u);
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const FollowingError &without = runs[0].errors[i], &velocity = runs[1].errors[i],
                         &both = runs[2].errors[i];
    EXPECT_GT(without.worst, 10 * both.worst) << machine.joints[i].name;
    EXPECT_GT(without.rms, 10 * both.rms) << machine.joints[i].name;
    EXPECT_GT(velocity.rms, both.rms) << machine.joints[i].name;
  }
}

/// The setpoints of every period.
struct SetpointList final : ReportSink {
  void write(const CycleReport& report) override { q.push_back(report.q_setpoint); }
  std::vector<JointVec> q;
};

// Feed-forward goes beside the setpoints and changes none of them. These drives do not listen to it, so that
// the axes stand in the same places.
TEST(Following, SetpointsAreTheSameBitsWithoutIt) {
  SetpointList lists[2];
  for (const bool on : {false, true}) {
    Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
    if (on) assembly.feed_forward = assemble(kMachine).feed_forward;
    EXPECT_EQ(assembly.feed_forward.has_value(), on);
    Parameters parameters;
    ToolTable tools;
    SimulationOptions options;
    options.program = "following";
    options.program_text = kText;
    options.trace = &lists[on];
    EXPECT_EQ(simulate(assembly, parameters, tools, options).fault, Fault::kOk);
  }
  ASSERT_GT(lists[0].q.size(), 1000u);
  ASSERT_EQ(lists[0].q.size(), lists[1].q.size());
  for (std::size_t k = 0; k < lists[0].q.size(); ++k)
    ASSERT_EQ(lists[0].q[k], lists[1].q[k]) << "period " << k;
}

TEST(Following, SaysThatThereIsNothingToCompare) {
  const auto make = [] { return assemble(source_dir() + "/configs/cradle.toml"); };
  try {
    run_following(make, program(), "");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("no section [feed_forward]"), std::string::npos);
  }
}

// The measurement of a setpoint comes so many periods later, and an axis that is exactly there has no error.
TEST(Following, ComparesWithTheSetpointThatTheMeasurementBelongsTo) {
  FollowingMeter meter(1, 2);
  CycleReport report;
  report.q_setpoint = report.q_measured = JointVec::Zero(1);
  for (int k = 0; k < 50; ++k) {
    report.q_setpoint[0] = k;
    report.q_measured[0] = k - 2 - (k == 30 ? 0.5 : 0);
    meter.write(report);
  }
  EXPECT_DOUBLE_EQ(meter.errors()[0].worst, 0.5);
  EXPECT_NEAR(meter.errors()[0].rms, 0.5 / std::sqrt(48), 1e-12);
}

}  // namespace
}  // namespace trn
