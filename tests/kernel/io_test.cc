#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "kernel/daemon/program_feeder.h"
#include "kernel/replay.h"
#include "kernel/simulation.h"
#include "tests/support/paths.h"

// Outputs, inputs and the probe through the whole kernel, on simulated devices; and again from the log.
namespace trn {
namespace {

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::string written(const std::string& name, const std::string& text) {
  const std::string path =
      testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + name;
  std::ofstream(path) << text;
  return path;
}

/// A shipped machine with a section [io] of the test's own.
std::string machine_with(const std::string& io, const std::string& machine = "mill") {
  std::string text = text_of(source_dir() + "/configs/" + machine + ".toml");
  text.resize(std::min(text.size(), text.find("\n[io]")));  // the last one
  return written("m.toml", text + "\n[io]\ntype = \"simulated\"\n" + io);
}

constexpr const char* kPlate = "[[io.plate]]\nmin_mm = [-50, -50, -60]\nmax_mm = [50, 50, -20.5]\n";

struct Reports : ReportSink {
  void write(const CycleReport& report) override { all.push_back(report); }
  std::vector<CycleReport> all;
};

/// A program run on such a machine, with what the tick reported and what the parameters were in the end.
struct IoRun {
  explicit IoRun(const std::string& config, const std::string& program) : assembly(assemble(config)) {
    SimulationOptions options;
    options.program = written("p.ngc", program);
    options.trace = &reports;
    result = simulate(assembly, parameters, tools, options);
  }
  /// The first period with this event; its report.
  const CycleReport* event(QueueEvent::Kind kind) const {
    for (const CycleReport& report : reports.all)
      if (report.event.kind == kind) return &report;
    return nullptr;
  }
  Assembly assembly;
  Parameters parameters;
  ToolTable tools;
  Reports reports;
  SimulationResult result;
};

TEST(Io, AProbeMoveEndsAtThePlateAndTheProgramKnowsWhere) {
  const IoRun run(
      machine_with(kPlate),
      "G21 G90 G61 F300\nG0 X3 Y4\nG38.2 Z-40\n#1=#5063 #2=#5070 #3=#5422\nG0 Z[#3+10]\nG1 X[#1]\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  EXPECT_LE(run.result.deviation.tip_mm.value, 1e-6);
  const CycleReport* end = run.event(QueueEvent::Kind::kProbeEnd);
  ASSERT_NE(end, nullptr);
  // 5 mm/s: the tip goes 0.005 mm a period, and is heard one period later.
  EXPECT_NEAR(end->answer.q_contact[2], -20.5, 0.011);
  EXPECT_LE(end->answer.q_contact[2], -20.5);
  EXPECT_LT(end->q_setpoint[2], -20.5);
  EXPECT_GT(end->q_setpoint[2], -21);
  const Parameters& p = run.parameters;
  EXPECT_NEAR(p[5063], end->answer.q_contact[2], 1e-9);
  EXPECT_NEAR(p[5061], 3, 1e-6);
  EXPECT_EQ(p[5070], 1);
  EXPECT_NEAR(p[3], end->q_setpoint[2], 1e-9);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[2], p[3] + 10, 1e-9);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[0], p[1], 1e-9);
}

// The contact is that of the tip in the work offset, with a tool, in inches, on a machine that tilts.
TEST(Io, TheContactIsInProgramCoordinates) {
  IoRun run(machine_with(kPlate, "cradle"),
            "G21 G10 L2 P1 X10 Y-5 Z-8 R90\nG10 L1 P1 Z25\nT1 M6 G43 H1\nG20 G54 F10\nG0 X0.1 Y0.2 Z0.5\n"
            "G38.3 Z-2\n#1=#5063 #2=#5070 #3=#5061\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_EQ(run.parameters[5070], 1);
  EXPECT_NEAR(run.parameters[5063], (-20.5 + 8) / 25.4, 0.02 / 25.4);
  EXPECT_NEAR(run.parameters[5061], 0.1, 1e-7);
}

TEST(Io, AMoveThatMustMeetSomethingAndDoesNotIsAFault) {
  const IoRun run(machine_with(kPlate), "F600 G0 X3\nG38.2 Z-15\nG0 X90\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kProbe);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[2], -15, 1e-9);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[0], 3, 1e-9);  // nothing of what follows
}

TEST(Io, AMoveThatMayMissGoesOnWithZero) {
  const IoRun run(machine_with(kPlate), "F600 G38.3 Z-15\no1 if [#5070 EQ 0]\nG0 X7\no1 endif\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[0], 7, 1e-9);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[2], -15, 1e-9);
}

TEST(Io, AProbeThatTouchesAlreadyIsAFault) {
  const IoRun run(machine_with(kPlate), "F600 G0 Z-22\nG38.2 Z-30\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kProbe);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[2], -22, 1e-9);
}

TEST(Io, TheProbeIsFoundLosingContactToo) {
  const IoRun run(machine_with(kPlate), "G21 F300 G0 Z-22\nG38.4 Z0\nG38.5 Z5\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kProbe) << "the second begins without contact";
  EXPECT_NEAR(run.parameters[5063], -20.5, 0.02);
  EXPECT_GE(run.parameters[5063], -20.5);
}

// M62 changes its output where the next move begins, without a stop; M64 at rest in between.
TEST(Io, SynchronisedOutputsActWhereTheMoveBegins) {
  const IoRun run(
      machine_with(""),
      "G21 G90 G64 P0.01 F6000\nG1 X50\nM62 P5\nM67 E2 Q1.5\nX100\nM63 P5\nX150\nM64 P1\nX160\nM2\n");
  double on_at = 0, off_at = 0, slowest = 1e9;
  for (std::size_t i = 1; i < run.reports.all.size(); ++i) {
    const CycleReport &before = run.reports.all[i - 1], &now = run.reports.all[i];
    const bool was = before.outputs >> 5 & 1, is = now.outputs >> 5 & 1;
    if (is && !was) on_at = now.q_setpoint[0];
    if (was && !is) off_at = now.q_setpoint[0];
    if (now.q_setpoint[0] > 45 && now.q_setpoint[0] < 105) slowest = std::min(slowest, now.speed_mm_s);
    const bool still = (now.outputs >> 1 & 1) && !(before.outputs >> 1 & 1);
    if (still) {
      EXPECT_NEAR(now.q_setpoint[0], 150, 1e-9);
    }
  }
  EXPECT_NEAR(on_at, 50, 0.11);
  EXPECT_NEAR(off_at, 100, 0.11);
  EXPECT_GT(slowest, 99);
  EXPECT_EQ(run.reports.all.back().outputs, 2U);
}

TEST(Io, AProgramWaitsForInputs) {
  const std::string io =
      "[[io.wire]]\noutput = 3\ninput = 4\ndelay_s = 0.5\n"
      "[[io.wire]]\nanalog_output = 0\nanalog_input = 7\n";
  const IoRun run(machine_with(io),
                  "M64 P3\nM66 P4 L3 Q2\n#1=#5399\nM65 P3\nM66 P4 L2 Q0.2\n#2=#5399\nM66 P4 L2 Q2\n#3=#5399\n"
                  "M66 P4 L0\n#4=#5399\nM68 E0 Q2.25\nG4 P0.01\nM66 E7\n#5=#5399\nG0 X[#5]\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_EQ(run.parameters[1], 1);
  EXPECT_EQ(run.parameters[2], -1) << "not in time";
  EXPECT_EQ(run.parameters[3], 0);
  EXPECT_EQ(run.parameters[4], 0);
  EXPECT_EQ(run.parameters[5], 2.25);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[0], 2.25, 1e-9);
  EXPECT_NEAR(run.result.cycle_time_s, 0.5 + 0.5 + 0.01, 0.25);
}

TEST(Io, TheSpindleComesToItsSpeedAndPlaceBeforeTheProgramGoesOn) {
  const IoRun run(machine_with("[io.spindle]\nacceleration_rpm_s = 2000\n"),
                  "S3000 M3\nG0 X1\nM19 R90\nG0 X2\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  std::size_t moves_at = 0;
  while (run.reports.all[moves_at].q_setpoint[0] == 0) ++moves_at;
  EXPECT_NEAR(static_cast<double>(moves_at) * 0.001, 0.99 * 1.5, 0.02);
  const CycleReport* orient = run.event(QueueEvent::Kind::kSpindleOrient);
  ASSERT_NE(orient, nullptr);
  EXPECT_NEAR(std::remainder(orient->spindle_turns - 0.25, 1.0), 0, 1e-8);
}

TEST(Io, ASpindleThatDoesNotComeToSpeedIsAFault) {
  const IoRun run(machine_with("spindle_timeout_s = 0.5\n[io.spindle]\nacceleration_rpm_s = 2000\n"),
                  "S3000 M3\nG0 X1\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kSpindle);
  EXPECT_EQ(run.reports.all.back().q_setpoint[0], 0);
}

// On the thread, behind the run-in, the tool is where the spindle's turns say, also where those wave.
TEST(Io, AThreadFollowsTheSpindle) {
  const IoRun run(
      machine_with("[io.spindle]\nacceleration_rpm_s = 5000\nload_share = 0.02\nload_hz = 1.5\n"),
      "G21 G90 S600 M3\nG0 X10 Z0\nG33 Z-60 K1.5\nG0 X20\nG0 Z0\nX10\nG33 Z-60 K1.5\nG0 X20\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  std::vector<double> phase[2];  // turns that z is ahead, in both passes
  std::size_t pass = 0, count = 0;
  for (const CycleReport& report : run.reports.all) {
    const double z = report.q_setpoint[2];
    if (report.event.kind == QueueEvent::Kind::kGearEnd) ++pass;
    if (report.gear_lag_s == 0 || z > -5 || z < -55 || pass > 1) continue;
    phase[pass].push_back(-z / 1.5 - report.spindle_turns);
    ++count;
  }
  ASSERT_GT(count, 4000U);
  for (const auto& turns : phase) {
    const auto [least, most] = std::minmax_element(turns.begin(), turns.end());
    EXPECT_LT(*most - *least, 0.001) << "a tenth of what the spindle turns in a period";
  }
  const double apart = phase[1].front() - phase[0].front();
  EXPECT_NEAR(apart, std::round(apart), 0.012) << "the second pass meets the groove of the first";
}

TEST(Io, AThreadingCycleRunsThrough) {
  const IoRun run(machine_with("[io.spindle]\nacceleration_rpm_s = 5000\n"),
                  "G21 G18 S600 M3\nG0 X10 Z0\nG76 P1 Z-20 I-1 J0.2 K0.6 R1.5 Q29.5 L2 E1\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[0], 10, 1e-9);
  EXPECT_NEAR(run.reports.all.back().q_setpoint[2], -20, 1e-9);
}

TEST(Io, AThreadThatAJointCannotFollowIsRefused) {
  const std::string config = machine_with("[io.spindle]\n");
  EXPECT_THROW(IoRun(config, "S9000 M3\nG33 Z-50 K3\nM2\n"), ProgramError);
}

TEST(Io, AThreadWithoutATurningSpindleIsAFault) {
  const IoRun run(machine_with("spindle_timeout_s = 0.3\n[io.spindle]\nacceleration_rpm_s = 1\n"),
                  "S1 M3\nG33 Z-5 K1\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kSpindle);
}

// What a machine without such a section can do is what it could before.
TEST(Io, WithoutDevicesTheProgramIsCheckedAndRefused) {
  Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  const ProgramStart start{"mdi", "F60 G38.2 Z-5\n", JointVec::Zero(5)};
  EXPECT_THROW(check_program(assembly, {}, {}, start, {}), ProgramError);
}

TEST(Io, TheDryCheckEndsWhereTheMachineIsAsked) {
  Assembly assembly = assemble(machine_with(kPlate));
  const ProgramStart start{"mdi", "F60 G38.2 Z-5\nG0 X[9999*#5070]\n", JointVec::Zero(3)};
  EXPECT_EQ(check_program(assembly, {}, {}, start, {}).asks_at, 1U);
}

/// As the daemon has it: the feeder in its thread, the tick here, and a log of both.
std::vector<JointVec> recorded_session(const std::string& config, const std::string& program,
                                       const std::string& log_path) {
  const Assembly assembly = assemble(config);
  MotionQueue queue(8192);
  Cycle cycle({assembly.machine.period_s, assembly.machine.joints, true, 8, assembly.plan_joints},
              *assembly.map, queue, *assembly.drives, nullptr, assembly.io.get());
  SessionLog log(log_path, {config, "", ""});
  ProgramFeeder feeder(assembly, queue, {}, {}, &log);
  std::vector<JointVec> rows;
  RtCommand start{RtCommand::Kind::kStart};
  const auto tick = [&] {
    cycle.tick();
    log.report(cycle.last_report());
    if (cycle.last_report().drives == DriveState::kEnabled) rows.push_back(cycle.last_report().q_setpoint);
  };
  assembly.drives->bring_up();
  while (cycle.last_report().drives != DriveState::kEnabled) tick();
  feeder.load(program, cycle.last_report().q_setpoint);
  start.id = 1;
  log.posted(start);
  cycle.post(start);
  tick();
  for (int i = 0; i < 200000 && cycle.last_report().motion != MotionState::kRest; ++i) tick();
  EXPECT_EQ(cycle.last_report().motion, MotionState::kRest);
  EXPECT_EQ(cycle.last_report().fault, Fault::kOk);
  return rows;
}

TEST(Io, ASessionWithProbeAndInputsIsReplayedBitForBit) {
  const std::string config =
      machine_with(std::string(kPlate) + "[[io.wire]]\noutput = 3\ninput = 4\ndelay_s = 0.25\n");
  const std::string program =
      written("p.ngc",
              "G21 G90 G64 P0.01 F900\nG0 X5\nG38.2 Z-40\n#1=[#5063+3]\nG0 Z[#1]\nM64 P3\nM66 P4 L3 Q5\n"
              "G1 X[20*#5399] Y1\nX0 Y2\nM2\n");
  const std::string log = written("s.log", "");
  const std::vector<JointVec> rows = recorded_session(config, program, log);
  EXPECT_NEAR(rows.back()[2], -17.5, 0.05);
  const Session session = read_session(log);
  const Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  Reports again;
  replay(session, assembly, parameters, tools, again);
  const std::size_t count = std::min(again.all.size(), rows.size());
  ASSERT_GE(count + 400, rows.size());
  for (std::size_t i = 0; i < count; ++i) ASSERT_EQ(again.all[i].q_setpoint, rows[i]) << "period " << i;
}

}  // namespace
}  // namespace trn
