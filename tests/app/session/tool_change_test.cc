#include <fmt/format.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>

#include "app/daemon/planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/machine_memory.h"
#include "app/session/make_cycle.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// M6 through the whole kernel: it waits, is confirmed, is broken off, and is replayed.
namespace trn {
namespace {

constexpr const char* kTable = "T1 P1 Z+50 ;end mill\nT2 P2 Z+80 ;8 mm ball\nT3 P3 Z+20\n";

std::string written(const std::string& name, const std::string& text) {
  const std::string path =
      testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + name;
  std::ofstream(path) << text;
  return path;
}

/// The mill with a section [tool_change], and output 0 wired to input 0.
std::string mill_with(const std::string& tool_change) {
  std::ifstream in(source_dir() + "/configs/mill.toml");
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  return written("m.toml", text + "\n[tool_change]\n" + tool_change);
}

/// Planner thread and tick as the daemon has them.
struct Session {
  explicit Session(const std::string& config_in, const std::string& log_path = "")
      : config(config_in), vars(written("m.var", "")), assembly(assemble(config_in)) {
    std::filesystem::remove(vars);
    if (!log_path.empty())
      log = std::make_unique<SessionLog>(log_path, SessionHead{config, "", "", false, kTable});
    planner.emplace(assembly, queue, Parameters(), ToolTable::parse(kTable, "t"),
                    planner_listeners(log.get(), nullptr), MemoryFiles{vars, ""});
    assembly.drives->bring_up();
    while (report().drives != DriveState::kEnabled) tick();
  }
  const CycleReport& report() const { return cycle.last_report(); }
  void tick() {
    cycle.tick();
    if (log) log->report(report());
    if (report().drives == DriveState::kEnabled) rows.push_back(report().q_setpoint);
  }
  void post(RtCommand::Kind kind) {
    RtCommand command{kind};
    command.id = ++last_id;
    if (log) log->posted(command);
    cycle.post(command);
    tick();
  }
  void start(const std::string& program, std::uint32_t from_line = 0) {
    const std::string path = written("p.ngc", program);
    if (from_line > 1)
      planner->load_from(path, report().q_plan, from_line);
    else
      planner->load(path, report().q_plan);
    planner->starts();
    post(RtCommand::Kind::kStart);
  }
  /// Until it stands at an event that is not done, or rests. The planner's thread needs time of the clock,
  /// which ticks do not take.
  void go() {
    constexpr int kTicksAtOnce = 1000;
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
    while (std::chrono::steady_clock::now() < end) {
      for (int i = 0; i < kTicksAtOnce; ++i) {
        if (report().motion == MotionState::kRest || report().motion == MotionState::kPaused) return;
        tick();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ADD_FAILURE() << "it never rests";
  }
  void confirm() {
    planner->confirm_tool(report().waits_at.argument);
    post(RtCommand::Kind::kResume);
  }
  void stop() {
    planner->abandon();
    post(RtCommand::Kind::kStop);
    go();
  }
  double kept(int number) const {
    Parameters found;
    if (std::filesystem::exists(vars)) load_parameters(vars, found);
    return std::as_const(found)[number];
  }

  std::string config, vars;
  Assembly assembly;
  MotionQueue queue{8192};
  Cycle cycle = make_cycle(assembly, queue, ProgramStops::kWait);
  std::unique_ptr<SessionLog> log;
  std::optional<PlannerThread> planner;
  std::vector<JointVec> rows;
  std::uint32_t last_id = 0;
};

constexpr const char* kTwoTools =
    "G21 G90\nT1 M6\nG43 H1\nG0 Z10\nG1 X50 F6000\nT2 M6 G43 H2 G0 Z10\nG1 X0\nM2\n";

TEST(ToolChange, WaitsUntilTheOperatorHasConfirmed) {
  Session session(mill_with(""));
  session.start(kTwoTools);
  for (const int tool : {1, 2}) {
    session.go();
    ASSERT_EQ(session.report().motion, MotionState::kPaused);
    EXPECT_EQ(session.report().waits_at.kind, QueueEvent::Kind::kToolChange);
    EXPECT_EQ(session.report().waits_at.argument, tool);
    EXPECT_EQ(session.kept(parameter::kTool), tool - 1) << "the old one";
    const JointVec q = session.report().q_setpoint;
    for (int i = 0; i < 3000; ++i) session.tick();
    EXPECT_EQ(session.report().q_setpoint, q) << "however long it takes";
    session.confirm();
    EXPECT_EQ(session.kept(parameter::kTool), tool);
    EXPECT_EQ(session.report().motion, MotionState::kMoving);
  }
  session.go();
  EXPECT_EQ(session.report().motion, MotionState::kRest);
  EXPECT_NEAR(session.report().q_setpoint[2], 10 + 80, 1e-9);
  EXPECT_NEAR(session.report().q_setpoint[0], 0, 1e-9);
  EXPECT_EQ(session.report().waits_at.kind, QueueEvent::Kind::kNone);
}

TEST(ToolChange, AStopInTheWaitLeavesTheOldTool) {
  Session session(mill_with(""));
  for (const bool quick : {false, true}) {
    session.start("G21 G90\nT3 M6\nG0 X5\nM2\n");
    session.go();
    ASSERT_EQ(session.report().motion, MotionState::kPaused);
    if (quick) {
      session.planner->abandon();
      session.post(RtCommand::Kind::kEmergencyStop);
      EXPECT_EQ(session.report().fault, Fault::kEmergencyStop);
    } else {
      session.stop();
    }
    EXPECT_EQ(session.report().motion, MotionState::kRest);
    EXPECT_EQ(session.report().waits_at.kind, QueueEvent::Kind::kNone);
    EXPECT_THROW(session.planner->confirm_tool(3), std::runtime_error) << "nobody waits any more";
    EXPECT_EQ(session.kept(parameter::kTool), 0);
  }
  EXPECT_EQ(session.report().q_setpoint[0], 0);
}

// Output 0 is wired to input 0, which follows 0.2 s later: while M6 waits.
TEST(ToolChange, AnInputConfirmsByItsRise) {
  Session session(mill_with("confirm = \"input\"\ninput = 0\n"));
  session.start("G21 G90\nM64 P0\nT2 M6\nG0 X[#5400]\nM2\n");
  session.go();
  EXPECT_EQ(session.report().motion, MotionState::kRest);
  EXPECT_NEAR(session.report().q_setpoint[0], 2, 1e-9);
  EXPECT_EQ(session.kept(parameter::kTool), 2);
  // The input is still on: it may be stuck, and does not count.
  session.start("T3 M6\nG0 X9\nM2\n");
  for (int i = 0; i < 3000; ++i) session.tick();
  EXPECT_EQ(session.report().motion, MotionState::kMoving);
  EXPECT_EQ(session.report().waits_at.kind, QueueEvent::Kind::kToolChange);
  session.stop();
  EXPECT_EQ(session.kept(parameter::kTool), 2);
}

TEST(ToolChange, NobodyIsAskedWhereTheConfigSaysSo) {
  Session session(mill_with("confirm = \"none\"\n"));
  session.start(kTwoTools);
  session.go();
  EXPECT_EQ(session.report().motion, MotionState::kRest);
  EXPECT_EQ(session.kept(parameter::kTool), 2);
}

TEST(ToolChange, BegunFurtherDownTheToolIsAskedForBeforeTheWayThere) {
  Session session(mill_with(""));
  session.start(kTwoTools, 7);
  session.go();
  ASSERT_EQ(session.report().motion, MotionState::kPaused);
  EXPECT_EQ(session.report().waits_at.argument, 2);
  EXPECT_EQ(session.report().q_setpoint[0], 0);
  session.confirm();
  session.go();
  EXPECT_EQ(session.report().motion, MotionState::kRest);
  EXPECT_NEAR(session.report().q_setpoint[2], 90, 1e-9);
}

TEST(ToolChange, ARunPassesAndSaysSo) {
  for (const char* confirm : {"", "confirm = \"input\"\ninput = 9\n"}) {
    Assembly assembly = assemble(mill_with(confirm));
    Parameters parameters;
    ToolTable tools = ToolTable::parse(kTable, "t");
    SimulationOptions options;
    options.program = written("p.ngc", kTwoTools);
    std::vector<std::pair<std::uint32_t, int>> told;
    options.on_tool = [&](std::uint32_t line, int tool) { told.emplace_back(line, tool); };
    const SimulationResult result = simulate(assembly, parameters, tools, options);
    EXPECT_TRUE(result.within_limits);
    EXPECT_EQ(told, (std::vector<std::pair<std::uint32_t, int>>{{2, 1}, {6, 2}}));
    EXPECT_EQ(std::as_const(parameters)[parameter::kTool], 2);
  }
}

// Random programs of moves and tools, some stopped on the way: replayed to the bit, and the spindle's tool is
// the last that was confirmed.
TEST(ToolChange, SessionsAreReplayedBitForBit) {
  const int count = test::rounds(3, 10);
  for (int seed = 1; seed <= count; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(static_cast<unsigned>(seed));
    const auto pick = [&](int n) { return std::uniform_int_distribution(0, n - 1)(random); };
    std::string program = "G21 G90 F6000\n";
    for (int i = 0; i < 12; ++i) {
      const int tool = 1 + pick(3);
      if (pick(3) == 0)
        program += fmt::format("T{} M6{}\n", tool, pick(2) ? fmt::format(" G43 H{}", tool) : "");
      program += fmt::format("G1 X{} Y{} Z{}\n", pick(40), pick(40), pick(20));
    }
    const std::string log = written("s.log", "");
    Session session(mill_with(""), log);
    session.start(program + "M2\n");
    int last = 0, patience = pick(2) ? 100 : pick(4);
    for (session.go(); session.report().motion == MotionState::kPaused; session.go()) {
      if (patience-- == 0) {
        session.stop();
        break;
      }
      for (int i = pick(50); i > 0; --i) session.tick();
      last = session.report().waits_at.argument;
      session.confirm();
    }
    EXPECT_EQ(session.kept(parameter::kTool), last);
    struct Rows : ReportSink {
      void write(const CycleReport& report) override { q.push_back(report.q_setpoint); }
      std::vector<JointVec> q;
    } again;
    const Assembly assembly = assemble(session.config);
    Parameters parameters;
    ToolTable tools = ToolTable::parse(kTable, "t");
    replay(read_session(log), assembly, parameters, tools, again);
    const std::size_t common = std::min(again.q.size(), session.rows.size());
    ASSERT_GE(common + 400, session.rows.size());
    for (std::size_t i = 0; i < common; ++i) ASSERT_EQ(again.q[i], session.rows[i]) << "period " << i;
  }
}

}  // namespace
}  // namespace trn
