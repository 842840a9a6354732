#include "app/session/replay.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "hal/loopback.h"
#include "interp/move.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

struct Rows : ReportSink {
  void write(const CycleReport& report) override { q.push_back(report.q_setpoint); }
  std::vector<JointVec> q;
};

/// A session as the daemon has it, in one thread: random commands, and a planner that sometimes sleeps.
class SessionBench {
 public:
  SessionBench(std::uint64_t seed, const std::string& config)
      : rng_(seed),
        assembly_(assemble(config)),
        drives_(JointVec::Zero(5)),
        queue_(8192),
        cycle_(make_cycle(assembly_, queue_, ProgramStops::kWait, drives_, nullptr)),
        log_(log_path(), {config, "", ""}) {
    drives_.bring_up();
  }
  static std::string log_path() {
    return testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".log";
  }

  void run(int periods) {
    std::uniform_int_distribution<int> wait(1, 300), kind(0, 7);
    std::uniform_real_distribution<double> value(0, 2);
    int next = 5, planner_sleeps = 0;
    for (int i = 0; i < periods; ++i) {
      if (cycle_.last_report().motion == MotionState::kRest && i > 3) begin();
      if (--planner_sleeps < 0) fill();
      if (--next == 0) {
        next = wait(rng_);
        using Kind = RtCommand::Kind;
        const Kind kinds[] = {Kind::kHold,     Kind::kResume, Kind::kOverride, Kind::kOverride,
                              Kind::kOverride, Kind::kStop,   Kind::kResume,   Kind::kResume};
        post({kinds[kind(rng_)], value(rng_)});
        if (kind(rng_) < 2) planner_sleeps = 8 * wait(rng_);
      }
      tick();
    }
  }
  const Assembly& assembly() const { return assembly_; }
  const CycleReport& report() const { return cycle_.last_report(); }
  const std::vector<JointVec>& rows() const { return rows_.q; }

 private:
  void post(RtCommand command) {
    command.id = ++id_;
    log_.posted(command);
    cycle_.post(command);
  }
  void tick() {
    const int channels = static_cast<int>(assembly_.corrections.sensors->names().size());
    std::uniform_int_distribution<int> when(0, 400);
    if (const int n = when(rng_); n < channels)
      assembly_.corrections.sensors->publish(n, 24 + 0.001 * when(rng_));
    cycle_.tick();
    for (const auto& work : assembly_.corrections.background) work();
    log_.report(cycle_.last_report());
    if (cycle_.last_report().drives == DriveState::kEnabled) rows_.write(cycle_.last_report());
  }
  void begin() {
    post({RtCommand::Kind::kStop});
    do tick();
    while (queue_.holds_stop() || queue_.buffered_s() > 0);  // often at once, in the period of the stop
    const ProgramStart start{
        "mdi", "G21 G94 G64 P0.02\nG91\nG1 F4000 X20\nY20 A5\nX-20 C10\nF900 Y-20 A-5\nX5 C-10\nX-5\n",
        cycle_.last_report().q_setpoint};
    pipeline_.emplace(assembly_, parameters_, tools_, start, PipelineObservers{});
    log_.program(start);
    queue_.begin_generation();
    ended_ = has_block_ = false;
    fill();
    post({RtCommand::Kind::kStart});
  }
  void fill() {
    while (pipeline_ && !ended_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (!has_block_ && !(has_block_ = pipeline_->next(block_))) ended_ = true;
      if (!has_block_ || !queue_.push(block_)) break;
      has_block_ = false;
    }
  }

  std::mt19937_64 rng_;
  Assembly assembly_;
  LoopbackDrives drives_;
  MotionQueue queue_;
  Cycle cycle_;
  SessionLog log_;
  Parameters parameters_;
  ToolTable tools_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool ended_ = true, has_block_ = false;
  std::uint32_t id_ = 0;
  Rows rows_;
};

/// A session and its replay on a machine assembled anew; how often the planner was late.
std::uint32_t expect_same_bits(std::uint64_t seed, const std::string& config, int periods) {
  std::optional<SessionBench> bench;
  bench.emplace(seed, config);
  bench->run(periods);
  const Session session = read_session(SessionBench::log_path());
  const Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  Rows again;
  replay(session, assembly, parameters, tools, again);
  EXPECT_GE(again.q.size() + 400, bench->rows().size());
  for (std::size_t i = 0; i < std::min(again.q.size(), bench->rows().size()); ++i)
    if (again.q[i] != bench->rows()[i]) {
      ADD_FAILURE() << "seed " << seed << " row " << i;
      break;
    }
  return bench->report().starvations;
}

TEST(Replay, GivesTheSameBitsAlsoWhereThePlannerWasLate) {
  std::uint32_t starvations = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    starvations += expect_same_bits(seed, source_dir() + "/configs/cradle.toml", 12000);
  EXPECT_GT(starvations, 0u) << "the planner was never late: this proves less than it should";
}

// What the sensors of the screws read is part of the session.
TEST(Replay, GivesTheSameBitsWithSensors) {
  expect_same_bits(7, source_dir() + "/configs/head_screws.toml", 12000);
}

// A log is replayed with the config that stands there now, which may have another joint or sensor since.
TEST(Replay, RefusesTheLogOfAnotherMachine) {
  using Kind = SessionEntry::Kind;
  const Assembly assembly = assemble(source_dir() + "/configs/head_screws.toml");
  const int joints = static_cast<int>(assembly.machine.joints.size());
  const int sensors = static_cast<int>(assembly.corrections.sensors->names().size());
  ASSERT_GT(sensors, 0);
  const auto refusal = [&](const SessionEntry& entry) -> std::string {
    Parameters parameters;
    ToolTable tools;
    Rows rows;
    Session session{{"m.toml", "", ""}, {entry}};
    session.entries[0].period = 3;
    try {
      replay(session, assembly, parameters, tools, rows);
    } catch (const ProgramError& error) {
      return error.what();
    }
    return "";
  };
  SessionEntry stands, contact, fault, sensor, command;
  stands.kind = Kind::kStands;
  contact.kind = Kind::kAnswer;
  contact.answer.probe = true;
  for (const int size : {joints - 1, joints, joints + 1}) {
    stands.program.q = contact.answer.q_contact = JointVec::Zero(size);
    EXPECT_EQ(refusal(stands).empty(), size == joints) << size;
    EXPECT_EQ(refusal(contact).empty(), size == joints) << size;
  }
  sensor.kind = Kind::kSensor;
  for (const int channel : {0, sensors - 1, sensors}) {
    sensor.sensor = {channel, 20};
    EXPECT_EQ(refusal(sensor).empty(), channel < sensors) << channel;
  }
  fault.kind = Kind::kFault;
  fault.fault = Fault::kDriveFault;
  for (const int joint : {-2, -1, 0, joints - 1, joints}) {
    fault.joint = command.command.joint = joint;
    EXPECT_EQ(refusal(fault).empty(), joint >= -1 && joint < joints) << joint;
    command.command.kind = RtCommand::Kind::kJog;
    EXPECT_EQ(refusal(command).empty(), joint >= 0 && joint < joints) << joint;
    command.command.kind = RtCommand::Kind::kHome;
    EXPECT_EQ(refusal(command).empty(), joint >= -1 && joint < joints) << joint;
    command.command.kind = RtCommand::Kind::kOverride;
    EXPECT_EQ(refusal(command), "") << "is of no joint";
  }
  command.command.kind = RtCommand::Kind::kCorrection;
  const int corrections = assembly.corrections.setpoint->size();
  for (const int number : {-1, 0, corrections - 1, corrections}) {
    command.command.joint = number;
    EXPECT_EQ(refusal(command).empty(), number >= 0 && number < corrections) << number;
  }
  const std::string told = refusal(command);
  EXPECT_NE(told.find("in period 3 it has a command for correction " + std::to_string(corrections)),
            std::string::npos)
      << told;
}

TEST(Replay, RefusesWhatIsNoLog) {
  const std::string path = testing::TempDir() + "no.log";
  std::ofstream(path) << "{\"machine\": \"x\", \"tools\": \"\", \"vars\": \"\"}\nX10\n";
  try {
    read_session(path);
    FAIL();
  } catch (const ProgramError& error) {
    EXPECT_EQ(std::string(error.what()).find(path + ":2:"), 0u) << error.what();
  }
  EXPECT_THROW(read_session("/nonexistent.log"), ProgramError);
}

}  // namespace
}  // namespace trn
