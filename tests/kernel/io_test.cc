#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "app/daemon/planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/operator_script.h"
#include "app/session/pipeline.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
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
  IoRun(const std::string& config, const std::string& program, std::vector<OperatorAction> script = {})
      : assembly(assemble(config)) {
    SimulationOptions options;
    options.script = std::move(script);
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

/// How far tip and spindle were from each other in the taps of a run, and how deep it went.
struct TapRecord {
  double turns_off = 0, depth = 0, turns_s = 0;
  int count = 0, periods = 0;
};

TapRecord taps_of(const IoRun& run, double top, double per_turn_mm, double sense) {
  TapRecord out;
  bool taps = false;
  double from = 0, before = 0;
  for (const CycleReport& report : run.reports.all) {
    if (report.fault != Fault::kOk) break;  // the drives brake by themselves from here on
    const QueueEvent& event = report.event;
    if (event.kind == QueueEvent::Kind::kGearStart) {
      taps = true;
      from = report.spindle_turns;
      ++out.count;
    }
    if (taps) {
      ++out.periods;
      const double z = report.q_setpoint[2], turns = sense * (report.spindle_turns - from);
      out.turns_off = std::max(out.turns_off, std::abs((top - z) / per_turn_mm - turns));
      out.depth = std::min(out.depth, z);
      out.turns_s = std::max(out.turns_s, std::abs(report.spindle_turns - before) / 0.001);
    }
    if (event.kind == QueueEvent::Kind::kGearEnd) taps = false;
    before = report.spindle_turns;
  }
  return out;
}

constexpr const char* kTapSpindle =
    "[io.spindle]\nacceleration_rpm_s = 2000\nlag_s = 0.01\nload_share = 0.02\nload_hz = 1.5\n";

// The spindle lags 10 ms behind, waves by 2 %, turns 0.01 turns in a period and takes 0.3 s to stand.
TEST(Io, ARigidTapKeepsItsPitchThroughTheReversal) {
  const IoRun run(machine_with(kTapSpindle),
                  "G21 G90 S600 M3\nG0 X10 Z5\nG33.1 Z-20 K1.25\nG0 X20\nG33.1 Z-20 K1.25\nG4 P0.2\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  const TapRecord tap = taps_of(run, 5, 1.25, 1);
  EXPECT_EQ(tap.count, 2);
  EXPECT_LT(tap.turns_off, 0.01) << "what the spindle turns in a period";
  EXPECT_NEAR(tap.depth, -20, 1e-9) << "no overshoot";
  EXPECT_GT(tap.turns_s, 9.5);
  EXPECT_LT(tap.turns_s, 10.5);
  const CycleReport& end = run.reports.all.back();
  EXPECT_NEAR(end.q_setpoint[2], 5, 1e-9);
  EXPECT_EQ(end.q_setpoint[0], 20);
  const CycleReport* dwell = run.event(QueueEvent::Kind::kDwell);
  ASSERT_NE(dwell, nullptr);
  EXPECT_EQ(dwell->spindle_rpm, 600) << "turns as before";
  EXPECT_TRUE(dwell->spindle_ready);
}

// The path's own acceleration is 0.8 of what the spindle can do: without lag nothing has to wait for
// anything.
TEST(Io, ATapIsNoFasterThanItsSpindleCanFollow) {
  const IoRun run(machine_with("[io.spindle]\nacceleration_rpm_s = 2000\n"),
                  "G21 G90 S600 M3\nG0 X10 Z5\nG33.1 Z-20 K1.25\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_LT(taps_of(run, 5, 1.25, 1).turns_off, 1e-4);
  double most = 0;
  const std::vector<CycleReport>& all = run.reports.all;
  std::size_t i = 0;
  while (all[i].event.kind != QueueEvent::Kind::kGearStart) ++i;
  for (i += 2; i < all.size(); ++i) {
    const double second = all[i].q_setpoint[2] - 2 * all[i - 1].q_setpoint[2] + all[i - 2].q_setpoint[2];
    most = std::max(most, std::abs(second) / 1e-6);
  }
  const double bound = 0.8 * 2000 / 60 * 1.25;
  EXPECT_LT(most, 1.001 * bound);
  EXPECT_GT(most, 0.95 * bound);
}

TEST(Io, ALeftHandTapTurnsTheOtherWay) {
  const IoRun run(machine_with(kTapSpindle), "G20 G90 S300 M4\nG0 Z0.1\nG33.1 Z-0.5 K0.05\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  const TapRecord tap = taps_of(run, 2.54, 1.27, -1);
  EXPECT_EQ(tap.count, 1);
  EXPECT_LT(tap.turns_off, 0.01);
  EXPECT_NEAR(tap.depth, -12.7, 1e-9);
}

// Overrides and a hold wait for the end of the tap; the same tap without them takes as long.
TEST(Io, NothingTheOperatorTurnsChangesATap) {
  const std::string config = machine_with(kTapSpindle);
  const std::string program = "G21 G90 S600 M3\nG0 X10 Z5\nG33.1 Z-20 K1.25\nG1 F1000 X20\nM2\n";
  const IoRun plain(config, program);
  using Kind = RtCommand::Kind;
  const double inside_s = 4.0;  // the spindle needs up to 2 s to find its mark, the tap then 4.8 s
  const IoRun turned(config, program,
                     {{inside_s, {Kind::kOverride, 0.5}},
                      {inside_s, {Kind::kSpindleOverride, 1.2}},
                      {inside_s, {Kind::kHold}},
                      {9.0, {Kind::kResume}}});
  EXPECT_EQ(turned.result.fault, Fault::kOk);
  const TapRecord one = taps_of(plain, 5, 1.25, 1), other = taps_of(turned, 5, 1.25, 1);
  EXPECT_EQ(one.periods, other.periods);
  EXPECT_LT(other.turns_off, 0.01);
  EXPECT_GT(turned.result.cycle_time_s, plain.result.cycle_time_s + 2) << "held behind the tap";
}

// A spindle that answers so late that the tap would break.
TEST(Io, ASpindleThatDoesNotFollowATapIsAFault) {
  const IoRun run(machine_with("[io.spindle]\nacceleration_rpm_s = 20000\nlag_s = 0.5\n"),
                  "G21 G90 S1500 M3\nG0 Z5\nG33.1 Z-40 K1.25\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kSpindle);
  EXPECT_LT(taps_of(run, 5, 1.25, 1).turns_off, 0.3) << "told as soon as it is a quarter of a turn";
}

TEST(Io, ATapNeedsADepthAndAnEncoder) {
  EXPECT_THROW(IoRun(machine_with(kTapSpindle), "S600 M3\nG33.1 Z0 K1\nM2\n"), ProgramError);
  EXPECT_THROW(IoRun(machine_with("[io.spindle]\nencoder = false\n"), "S600 M3\nG33.1 Z-5 K1\nM2\n"),
               ProgramError);
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

/// As the daemon has it: the planner in its thread, the tick here, and a log of both.
std::vector<JointVec> recorded_session(const std::string& config, const std::string& program,
                                       const std::string& log_path) {
  const Assembly assembly = assemble(config);
  MotionQueue queue(8192);
  Cycle cycle = make_cycle(assembly, queue, ProgramStops::kWait);
  SessionLog log(log_path, {config, "", ""});
  PlannerThread planner(assembly, queue, {}, {}, planner_listeners(&log, nullptr));
  std::vector<JointVec> rows;
  RtCommand start{RtCommand::Kind::kStart};
  const auto tick = [&] {
    cycle.tick();
    log.report(cycle.last_report());
    if (cycle.last_report().drives == DriveState::kEnabled) rows.push_back(cycle.last_report().q_setpoint);
  };
  assembly.drives->bring_up();
  while (cycle.last_report().drives != DriveState::kEnabled) tick();
  planner.load(program, cycle.last_report().q_setpoint);
  start.id = 1;
  log.posted(start);
  cycle.post(start);
  tick();
  for (int i = 0; i < 200000 && cycle.last_report().motion != MotionState::kRest; ++i) tick();
  EXPECT_EQ(cycle.last_report().motion, MotionState::kRest);
  EXPECT_EQ(cycle.last_report().fault, Fault::kOk);
  return rows;
}

// A loop that never ends: the check says how far it came, and the planner still lets itself be stopped.
TEST(Io, TheDryCheckGivesUpInAnEndlessLoop) {
  Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
  for (const char* body : {"", "G1 F100 X[#1]\n#1=[1-#1]\n"}) {
    const ProgramStart start{"mdi", fmt::format("o1 while [1]\n{}o1 endwhile\n", body), JointVec::Zero(3)};
    const ProgramSummary summary = check_program(assembly, {}, {}, start, {});
    EXPECT_GT(summary.endless, 10'000'000U) << body;
    EXPECT_NE(remark_on(summary).find("goes on"), std::string::npos);
  }
  const ProgramStart ends{"mdi", "o1 repeat [100000]\n#1=[#1+1]\no1 endrepeat\n", JointVec::Zero(3)};
  EXPECT_EQ(check_program(assembly, {}, {}, ends, {}).endless, 0U);
  ProgramStart behind{"mdi", "o1 while [1]\no1 endwhile\nG0 X1\n", JointVec::Zero(3)};
  behind.from_line = 3;
  EXPECT_THROW(check_program(assembly, {}, {}, behind, {}), std::runtime_error) << "the line is not reached";
}

TEST(Io, AnEndlessProgramIsLoadedAndDropped) {
  Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
  MotionQueue queue(8192);
  PlannerThread planner(assembly, queue, {}, {});
  const std::string remark =
      planner.load(written("p.ngc", "o1 while [1]\n#1=[#1+1]\no1 endwhile\nM2\n"), JointVec::Zero(3));
  EXPECT_NE(remark.find("goes on, perhaps for ever"), std::string::npos) << remark;
  EXPECT_EQ(planner.load(written("q.ngc", "G1 F100 X1\nM2\n"), JointVec::Zero(3)), "");
}

/// Runs such a session, replays it, compares; the last setpoints.
JointVec replayed(const std::string& config, const std::string& program_text) {
  const std::string program = written("p.ngc", program_text), log = written("s.log", "");
  const std::vector<JointVec> rows = recorded_session(config, program, log);
  const Session session = read_session(log);
  const Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  Reports again;
  replay(session, assembly, parameters, tools, again);
  const std::size_t count = std::min(again.all.size(), rows.size());
  EXPECT_GE(count + 400, rows.size());
  for (std::size_t i = 0; i < count; ++i)
    if (again.all[i].q_setpoint != rows[i]) {
      ADD_FAILURE() << "period " << i;
      break;
    }
  return rows.back();
}

TEST(Io, ASessionWithProbeAndInputsIsReplayedBitForBit) {
  const std::string config =
      machine_with(std::string(kPlate) + "[[io.wire]]\noutput = 3\ninput = 4\ndelay_s = 0.25\n");
  const JointVec end =
      replayed(config,
               "G21 G90 G64 P0.01 F900\nG0 X5\nG38.2 Z-40\n#1=[#5063+3]\nG0 Z[#1]\nM64 P3\nM66 P4 L3 Q5\n"
               "G1 X[20*#5399] Y1\nX0 Y2\nM2\n");
  EXPECT_NEAR(end[2], -17.5, 0.05);
}

TEST(Io, ASessionWithThreadAndTapIsReplayedBitForBit) {
  const JointVec end =
      replayed(machine_with(kTapSpindle), "G21 G90 S900 M3\nG33.1 Z-9 K1\nG33 Z-12 K1\nG0 X3\nM2\n");
  EXPECT_EQ(end[2], -12);
}

}  // namespace
}  // namespace trn
