#include "app/session/replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
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
#include "tests/app/session/session_bench.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

TEST(Replay, GivesTheSameBitsAlsoWhereThePlannerWasLate) {
  std::uint32_t starvations = 0, late_rate_plans = 0;
  const std::string config = source_dir() + "/configs/cradle.toml";
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SessionBench bench(seed, config);
    bench.run(12000);
    expect_same_bits(bench, seed, config);
    starvations += bench.report().starvations;
    late_rate_plans += bench.report().late_rate_plans;
  }
  EXPECT_GT(starvations, 0u) << "the planner was never late: this proves less than it should";
  EXPECT_GT(late_rate_plans, 0u) << "the rate planner was never late: this proves less than it should";
}

// What the sensors of the screws read is part of the session.
TEST(Replay, GivesTheSameBitsWithSensors) {
  const std::string config = source_dir() + "/configs/head_screws.toml";
  SessionBench bench(7, config);
  bench.run(12000);
  expect_same_bits(bench, 7, config);
}

struct SpindleRows : ReportSink {
  void write(const CycleReport& report) override {
    rpm = report.spindle_rpm;
    coolant = report.coolant;
    most_rpm = std::max(most_rpm, rpm);
  }
  double rpm = 0, most_rpm = 0;
  int coolant = 0;
};

// A stop switched off what the first line had switched on. The log says so with the second: a speed alone
// turns no spindle, and mist brings no flood with it. An earlier log does not say it.
TEST(Replay, ATypedLineBehindAStopBeginsWithWhatIsOn) {
  using Kind = SessionEntry::Kind;
  struct Row {
    const char* line;
    bool told;
    double rpm;
    int coolant;
  };
  for (const Row& row :
       {Row{"S200", true, 0, 0}, {"S200", false, 200, 0}, {"M7", true, 0, 1}, {"M7", false, 0, 3}}) {
    const Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
    JointVec home = JointVec::Zero(static_cast<Eigen::Index>(assembly.machine.joints.size()));
    for (Eigen::Index i = 0; i < home.size(); ++i) {
      const JointLimit& limit = assembly.machine.joints[static_cast<std::size_t>(i)].limit;
      home[i] = std::clamp(0.0, limit.min, limit.max);
    }
    Session session{{"mill.toml", "", ""}, {}};
    const auto add = [&](std::uint64_t period, Kind kind) -> SessionEntry& {
      SessionEntry& entry = session.entries.emplace_back();
      entry.period = period;
      entry.kind = kind;
      entry.program.q = entry.q_measured = home;
      return entry;
    };
    const auto type = [&](std::uint64_t period, const char* line) -> ProgramStart& {
      const std::size_t at = session.entries.size();
      ProgramStart& start = add(period, Kind::kProgram).program;
      start.path = "mdi";
      start.text = line;
      add(period, Kind::kCommand).command.kind = RtCommand::Kind::kStart;
      return session.entries[at].program;
    };
    add(2, Kind::kStands);
    type(10, "M3 S500 M8\nG4 P100");
    add(1000, Kind::kCommand).command.kind = RtCommand::Kind::kStop;
    ProgramStart& second = type(3000, row.line);
    if (row.told) second.outputs = {0, 0, true, true};
    add(3500, Kind::kCommand).command = {RtCommand::Kind::kOverride, 1};
    Parameters parameters;
    ToolTable tools;
    SpindleRows rows;
    replay(session, assembly, parameters, tools, rows);
    EXPECT_EQ(rows.most_rpm, 500) << "of the first line";
    EXPECT_EQ(rows.rpm, row.rpm) << row.line;
    EXPECT_EQ(rows.coolant, row.coolant) << row.line;
  }
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
    SessionRows rows;
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
    stands.program.q = stands.q_measured = contact.answer.q_contact = JointVec::Zero(size);
    EXPECT_EQ(refusal(stands).empty(), size == joints) << size;
    EXPECT_EQ(refusal(contact).empty(), size == joints) << size;
    stands.program.q = JointVec::Zero(joints);
    EXPECT_EQ(refusal(stands).empty(), size == joints) << "measured, " << size;
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

// What was lost on a full disk may have been anything: nothing behind it would be true.
TEST(Replay, EndsWhereTheLogHasAGap) {
  const std::string config = source_dir() + "/configs/cradle.toml";
  SessionBench bench(3, config);
  bench.run(6000);
  Session session = read_session(SessionBench::log_path());
  const std::size_t at = session.entries.size() / 2;
  const std::uint64_t since = session.entries[at].period;
  SessionEntry gap;
  gap.kind = SessionEntry::Kind::kGap;
  gap.since = since;
  gap.lost = 3;
  gap.period = session.entries[at + 3].period;
  const auto first = session.entries.begin() + static_cast<std::ptrdiff_t>(at);
  *session.entries.erase(first, first + 2) = gap;
  const Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  SessionRows again;
  const ReplayResult result =
      replay(parse_session(session_text(session), "gap.log"), assembly, parameters, tools, again);
  ASSERT_TRUE(result.gap);
  EXPECT_EQ(result.gap->lost, 3u);
  EXPECT_EQ(result.periods, since);
  ASSERT_FALSE(again.q.empty());
  ASSERT_LE(again.q.size(), bench.rows().size());
  for (std::size_t i = 0; i < again.q.size(); ++i) ASSERT_EQ(again.q[i], bench.rows()[i]) << i;
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
