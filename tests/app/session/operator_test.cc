#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "hal/loopback.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "kernel/single_block.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// What the operator may do, and what the program leaves to him: M48 to M53, rapid override, single block, and
// a run under an operator's script, with its log.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

std::string mill() { return source_dir() + "/configs/mill.toml"; }

/// A program in front of the tick, and one report a period.
class OperatedRun {
 public:
  explicit OperatedRun(const std::string& program, const std::string& config = mill())
      : motion_(config, program),
        queue_(motion_.blocks().size() + 1),
        drives_(motion_.q(0)),
        cycle_(cycle_config(motion_.assembly(), ProgramStops::kWait),
               {*motion_.assembly().map, queue_, drives_, *motion_.assembly().rate_plans}) {
    cycle_.tick();
    drives_.bring_up();
    for (int i = 0; i < 3; ++i) cycle_.tick();
    for (const MotionBlock& block : motion_.blocks()) queue_.push(block);
  }
  double period_s() const { return motion_.assembly().machine.period_s; }
  void post(Kind kind, double value = 0) { cycle_.post({kind, value}); }
  const CycleReport& tick() {
    cycle_.tick();
    return cycle_.last_report();
  }
  /// Until it rests, pauses or stands in a hold; what each period reported.
  std::vector<CycleReport> finish(int periods_max = 20000) {
    std::vector<CycleReport> out;
    do {
      out.push_back(tick());
      const bool held = out.back().motion == MotionState::kHeld && cycle_.rate().standing();
      if (held || out.back().motion == MotionState::kPaused) break;
    } while (out.back().motion != MotionState::kRest && static_cast<int>(out.size()) < periods_max);
    EXPECT_EQ(out.back().fault, Fault::kOk);
    return out;
  }
  const PlannedMotion& motion() const { return motion_; }

 private:
  PlannedMotion motion_;
  MotionQueue queue_;
  LoopbackDrives drives_;
  Cycle cycle_;
};

/// Least and greatest rate of each line, without its first `skip` periods.
std::map<std::uint32_t, std::pair<double, double>> rates(const std::vector<CycleReport>& reports, int skip) {
  std::map<std::uint32_t, std::pair<double, double>> out;
  std::map<std::uint32_t, int> seen;
  for (const CycleReport& report : reports) {
    if (++seen[report.line] <= skip) continue;
    auto& [low, high] = out.try_emplace(report.line, 1e9, -1e9).first->second;
    low = std::min(low, report.override_now);
    high = std::max(high, report.override_now);
  }
  return out;
}

TEST(OverrideWords, DisableAndEnableTheFeedOverrideInBlockOrder) {
  const char* kProgram = "G21 G91 G64 P0.01 F3000\nG1 X40\nM49\nG1 X40\nM48\nG1 X40\nM50 P0\nG1 X40\nM2\n";
  OperatedRun slow(kProgram);
  slow.post(Kind::kOverride, 0.5);
  slow.post(Kind::kStart);
  const auto half = rates(slow.finish(), 500);
  for (const std::uint32_t line : {2U, 6U}) {
    EXPECT_NEAR(half.at(line).first, 0.5, 1e-6) << line;
    EXPECT_NEAR(half.at(line).second, 0.5, 1e-6) << line;
  }
  for (const std::uint32_t line : {4U, 8U}) EXPECT_GT(half.at(line).first, 0.99) << line;

  OperatedRun fast(kProgram);
  fast.post(Kind::kOverride, 2);
  fast.post(Kind::kStart);
  const auto reports = fast.finish();
  const auto twice = rates(reports, 0);
  EXPECT_GT(twice.at(2).second, 1.9);
  EXPECT_GT(twice.at(6).second, 1.9);
  EXPECT_LE(twice.at(4).second, 1 + 1e-6) << "from the first period on";
  EXPECT_LE(twice.at(8).second, 1 + 1e-6);
}

TEST(OverrideWords, LeaveAHoldToTheLinesThatAllowIt) {
  OperatedRun run("G21 G91 G64 P0.01 F3000\nG1 X30\nM53 P0\nG1 X60\nM53 P1\nG1 X60\nM2\n");
  run.post(Kind::kStart);
  while (run.tick().line != 4) {
  }
  run.post(Kind::kHold);
  for (const CycleReport& report : run.finish()) {
    if (report.line != 4) continue;
    EXPECT_EQ(report.override_now, 1);
    EXPECT_EQ(report.motion, MotionState::kHeld);
  }
  EXPECT_EQ(run.tick().line, 6u);
  EXPECT_EQ(run.tick().override_now, 0);
  run.post(Kind::kResume);
  EXPECT_EQ(run.finish().back().motion, MotionState::kRest);
}

TEST(OverrideWords, LetTheAdaptiveFeedActWhereTheProgramSays) {
  OperatedRun run("G21 G91 G64 P0.01 F3000\nG1 X40\nM52 P1\nG1 X40\nM52 P0\nG1 X40\nM2\n");
  run.post(Kind::kAdaptiveFeed, 0.4);
  run.post(Kind::kStart);
  const auto found = rates(run.finish(), 500);
  EXPECT_EQ(found.at(2).first, 1);
  EXPECT_NEAR(found.at(4).second, 0.4, 1e-6);
  EXPECT_GT(found.at(6).first, 0.99);
}

TEST(RapidOverride, ActsOnRapidMovesAndTheFeedOverrideDoesNot) {
  OperatedRun run("G21 G91 G61.1 F3000\nG0 X80\nG1 X40\nG0 X-80\nM2\n");
  run.post(Kind::kRapidOverride, 0.25);
  run.post(Kind::kOverride, 1.5);
  run.post(Kind::kStart);
  const auto found = rates(run.finish(), 500);
  EXPECT_NEAR(found.at(2).second, 0.25, 1e-6);
  EXPECT_GT(found.at(3).second, 1.4);
  EXPECT_NEAR(found.at(4).first, 0.25, 1e-6);
}

TEST(SpindleOverride, ScalesTheSpindleWhereTheProgramLetsIt) {
  OperatedRun run("G21 G91 F3000\nM3 S1000\nG1 X10\nM51 P0\nG1 X10\nM51 P1\nM4\nG1 X10\nM5\nM2\n");
  run.post(Kind::kSpindleOverride, 0.8);
  run.post(Kind::kStart);
  std::map<std::uint32_t, double> rpm;
  for (const CycleReport& report : run.finish()) rpm[report.line] = report.spindle_rpm;
  EXPECT_EQ(rpm.at(3), 800);
  EXPECT_EQ(rpm.at(5), 1000);
  EXPECT_EQ(rpm.at(8), -800);
  EXPECT_EQ(run.tick().spindle_rpm, 0);
}

// Long blended lines: the machine stands on the blend between two lines, on the path the plan has anyway.
TEST(SingleBlock, StandsBetweenLinesOnThePlannedPath) {
  OperatedRun run("G21 G91 G64 P0.05 F4000\nG1 X40\nG1 Y30\nG1 X-40 Y5\nG4 P0.1\nG1 Y-20\nM2\n");
  std::vector<std::uint32_t> lines;
  JointJudge judge(run.motion().assembly().machine.joints, run.period_s());
  judge(run.tick().q_setpoint);
  run.post(Kind::kSingleBlock, 1);
  run.post(Kind::kStart);
  for (int i = 0; i < 10; ++i) {
    const auto reports = run.finish();
    for (const CycleReport& report : reports) judge(report.q_setpoint);
    EXPECT_LE(judge.worst(), LimitJudge::kRatioMax);
    lines.push_back(reports.back().line);
    if (reports.back().motion == MotionState::kRest) break;
    for (int k = 0; k < 20; ++k) EXPECT_EQ(run.tick().q_setpoint, reports.back().q_setpoint);
    run.post(Kind::kResume);
    judge(run.tick().q_setpoint);
  }
  EXPECT_EQ(lines, (std::vector<std::uint32_t>{2, 3, 4, 5, 6, 7}));
}

// Also where lines go on in one direction, and the machine stands in what the plan counts to the next.
TEST(SingleBlock, TheLineThatWasDrivenIsShown) {
  for (const char* const program : {"G21 G90 G64 P0.05 F4000\nG1 X20\nX40\nX60\nX90\nM2\n",
                                    "G21 G90 G61 F4000\nG1 X20\nX40\nX60\nX90\nM2\n",
                                    "G21 G90 G64 P0.05 F4000\nG1 X20\nX40 Y20\nX60 Y0\nX90 Y40\nM2\n"}) {
    OperatedRun run(program);
    run.post(Kind::kSingleBlock, 1);
    run.post(Kind::kStart);
    std::vector<std::uint32_t> lines;
    for (int i = 0; i < 6; ++i) {
      const auto reports = run.finish();
      lines.push_back(reports.back().line);
      if (reports.back().motion == MotionState::kRest) break;
      run.post(Kind::kResume);
      run.tick();
    }
    EXPECT_EQ(lines, (std::vector<std::uint32_t>{2, 3, 4, 5, 6})) << program;
  }
}

TEST(SingleBlock, SwitchedOnInMotionStandsAtTheFirstEndThatCanBeReached) {
  std::string program = "G21 G91 G64 P0.01 F6000\n";
  for (int i = 0; i < 200; ++i) program += i % 2 ? "G1 X1 Y0.1\n" : "G1 X1 Y-0.1\n";
  OperatedRun run(program + "M2\n");
  run.post(Kind::kStart);
  while (run.tick().line < 90) {
  }
  run.post(Kind::kSingleBlock, 1);
  const std::uint32_t first = run.finish().back().line;
  EXPECT_GE(first, 90u);
  EXPECT_LT(first, 100u) << "1 mm lines at 100 mm/s: a stop takes a few of them";
  run.post(Kind::kResume);
  run.tick();
  const auto next = run.finish();
  EXPECT_EQ(next.back().motion, MotionState::kPaused);
  EXPECT_LE(next.back().line, first + 2) << "from rest, a line at a time";
}

TEST(OperatorScript, IsReadLineByLine) {
  const std::string path = testing::TempDir() + "script.txt";
  std::ofstream(path) << "# a sweep\n0.5 override 50\n\n1 hold # now\n2 resume\n2 step on\n";
  const auto script = read_operator_script(path);
  ASSERT_EQ(script.size(), 4u);
  EXPECT_EQ(script[0].command.kind, Kind::kOverride);
  EXPECT_EQ(script[0].command.value, 0.5);
  EXPECT_EQ(script[3].command.kind, Kind::kSingleBlock);
  EXPECT_EQ(script[3].command.value, 1);
}

TEST(OperatorScript, NamesTheLineThatIsWrong) {
  const std::string path = testing::TempDir() + "script.txt";
  const std::pair<const char*, const char*> kWrong[] = {{"x hold\n", ":1: a line is"},
                                                        {"1 hold\n0.5 resume\n", ":2: this is before"},
                                                        {"1 override 300\n", ":1: override takes"},
                                                        {"1 step\n", ":1: step takes on or off"},
                                                        {"1 dance\n", ":1: 'dance' is no action"},
                                                        {"1 hold it\n", ":1: 'it' is too much"}};
  for (const auto& [text, message] : kWrong) {
    std::ofstream(path) << text;
    try {
      read_operator_script(path);
      ADD_FAILURE() << text;
    } catch (const ProgramError& error) {
      EXPECT_EQ(std::string(error.what()).find(path + message), 0u) << error.what();
    }
  }
}

struct Rows : ReportSink {
  void write(const CycleReport& report) override { q.push_back(report.q_setpoint); }
  std::vector<JointVec> q;
};

// A run under a script, and its log replayed: the same bits, and the machine stood where it was told to.
TEST(OperatorScript, RunsWithinTheLimitsAndItsLogReplays) {
  for (const char* name : {"cradle", "cradle_measured"}) {
    const std::string config = source_dir() + "/configs/" + name + ".toml";
    const std::string program = testing::TempDir() + "scripted.ngc",
                      log_path = testing::TempDir() + "run.log";
    std::ofstream(program) << "G21 G94 G64 P0.02 F4000\nG91\nG1 X20\nY20 A5\nM0\nX-20 C10\nG0 Y-20 A-5\nM2\n";
    SimulationOptions options;
    options.program = program;
    options.script = {{0.2, {Kind::kHold}},           {0.6, {Kind::kResume}},
                      {0.8, {Kind::kOverride, 2}},    {0.9, {Kind::kOverride, 0.3}},
                      {1.2, {Kind::kSingleBlock, 1}}, {2.5, {Kind::kResume}},
                      {4, {Kind::kSingleBlock, 0}},   {4, {Kind::kResume}}};
    Rows rows, again;
    options.trace = &rows;
    Assembly assembly = assemble(config);
    Parameters parameters;
    ToolTable tools;
    {
      SessionLog log(log_path, {config, "", "", true});
      options.log = &log;
      const SimulationResult result = simulate(assembly, parameters, tools, options);
      EXPECT_TRUE(result.within_limits);
      EXPECT_EQ(result.fault, Fault::kOk);
      EXPECT_GT(result.cycle_time_s, 4);
    }
    const Assembly fresh = assemble(config);
    Parameters fresh_parameters;
    replay(read_session(log_path), fresh, fresh_parameters, tools, again);
    EXPECT_EQ(again.q, rows.q) << name;
  }
}

}  // namespace
}  // namespace trn
