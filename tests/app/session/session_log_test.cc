#include "app/session/session_log.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/session/machine_outputs.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/ports.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"

// What is told to a log, and what is read of it again.
namespace trn {
namespace {

using Kind = SessionEntry::Kind;
using Command = RtCommand::Kind;

class SessionLogFile : public ::testing::Test {
 protected:
  void SetUp() override {
    log_ = std::make_unique<SessionLog>(path_, SessionHead{"m.toml", "t.tbl", "v.var", true});
  }
  void TearDown() override { std::filesystem::remove(path_); }

  /// A report of the next period.
  CycleReport next() {
    now_.period += 1;
    return now_;
  }
  void post(Command kind, std::uint32_t id, double value = 0, double speed = 0, int joint = 0) {
    log_->posted({kind, value, speed, joint, id});
  }
  std::vector<SessionEntry> entries() {
    log_.reset();
    return read_session(path_).entries;
  }
  std::string refusal(const std::string& text) {
    log_.reset();
    std::ofstream(path_) << text;
    try {
      read_session(path_);
    } catch (const ProgramError& error) {
      return std::string(error.what()).substr(path_.size());
    }
    return "";
  }

  std::string path_ = fmt::format("{}session_log_{}.log", ::testing::TempDir(), getpid());
  std::unique_ptr<SessionLog> log_;
  CycleReport now_;
};

TEST_F(SessionLogFile, BeginsWithItsHead) {
  log_.reset();
  const Session session = read_session(path_);
  EXPECT_EQ(session.head.machine, "m.toml");
  EXPECT_EQ(session.head.tools, "t.tbl");
  EXPECT_EQ(session.head.vars, "v.var");
  EXPECT_TRUE(session.head.run);
  EXPECT_TRUE(session.entries.empty());
}

// A command stands in the period that obeyed it: the tick says up to which number it has heard.
TEST_F(SessionLogFile, CommandsStandWhereTheyTookEffect) {
  now_.period = 100;
  post(Command::kJog, 7, -0.1, 2.5, 3);
  post(Command::kHold, 8);
  post(Command::kStop, 9);
  now_.last_command_id = 6;
  log_->report(next());
  now_.last_command_id = 8;
  log_->report(next());
  log_->report(next());
  now_.last_command_id = 9;
  log_->report(next());
  const auto read = entries();
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].period, 102u);
  EXPECT_EQ(read[0].command.kind, Command::kJog);
  EXPECT_EQ(read[0].command.value, -0.1);
  EXPECT_EQ(read[0].command.speed, 2.5);
  EXPECT_EQ(read[0].command.joint, 3);
  EXPECT_EQ(read[1].period, 102u);
  EXPECT_EQ(read[1].command.kind, Command::kHold);
  EXPECT_EQ(read[2].period, 104u);
  EXPECT_EQ(read[2].command.kind, Command::kStop);
}

TEST_F(SessionLogFile, TheCountOfCommandsMayBeginAnew) {
  post(Command::kHold, 0xFFFFFFFF);
  post(Command::kResume, 0);
  post(Command::kStop, 1);
  now_.last_command_id = 0xFFFFFFFE;
  log_->report(next());
  now_.last_command_id = 0;
  log_->report(next());
  const auto read = entries();
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[1].command.kind, Command::kResume);
}

TEST_F(SessionLogFile, EveryCommandComesBack) {
  const int count = static_cast<int>(Command::kSingleBlock) + 1;
  for (int i = 0; i < count; ++i) post(static_cast<Command>(i), static_cast<std::uint32_t>(i + 1));
  now_.last_command_id = static_cast<std::uint32_t>(count);
  log_->report(next());
  const auto read = entries();
  ASSERT_EQ(read.size(), static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    EXPECT_EQ(read[static_cast<std::size_t>(i)].command.kind, static_cast<Command>(i));
}

// Before any report, and behind one, it belongs to the tick that comes.
TEST_F(SessionLogFile, AProgramBelongsToTheNextPeriod) {
  ProgramStart file{"part.ngc", std::nullopt, JointVec::LinSpaced(3, 0.1, 0.3)};
  file.from_line = 12;
  file.switches = {3, true, false};
  log_->program(file);
  now_.period = 41;
  log_->report(next());
  log_->program({"mdi", "G0 X1 ; \xff\n\"quoted\"", JointVec::Zero(3)});
  const auto read = entries();
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].kind, Kind::kProgram);
  EXPECT_EQ(read[0].period, 0u);
  EXPECT_EQ(read[0].program.path, "part.ngc");
  EXPECT_FALSE(read[0].program.text);
  EXPECT_EQ(read[0].program.from_line, 12u);
  EXPECT_EQ(read[0].program.switches, (ProgramSwitches{3, true, false}));
  EXPECT_EQ(read[0].program.q, file.q) << "to the bit";
  EXPECT_EQ(read[1].period, 43u);
  EXPECT_EQ(*read[1].program.text, "G0 X1 ; \xef\xbf\xbd\n\"quoted\"")
      << "a byte that is no text is replaced";
  EXPECT_EQ(read[1].program.from_line, 0u);
}

TEST_F(SessionLogFile, WhereAProgramWasGivenUpIsTold) {
  log_->taken_back(12'345'678'901);
  log_->tool_deleted(7);
  const auto read = entries();
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].kind, Kind::kTakenBack);
  EXPECT_EQ(read[0].taken_back, 12'345'678'901u);
  EXPECT_EQ(read[1].kind, Kind::kDeleteTool);
  EXPECT_EQ(read[1].tool, 7);
}

// What is on at the machine when a typed line begins; a line without it, as of an earlier log, has none.
TEST_F(SessionLogFile, WhatIsOnIsToldWithATypedLine) {
  const std::vector<std::optional<MachineOutputs>> told = {MachineOutputs{-1234.5678, 3, true, false},
                                                           MachineOutputs{0, 0, false, true}, std::nullopt};
  for (const auto& outputs : told) {
    ProgramStart start{"mdi", "G0 X1", JointVec::Zero(3)};
    start.outputs = outputs;
    log_->program(start);
  }
  const auto read = entries();
  ASSERT_EQ(read.size(), told.size());
  for (std::size_t i = 0; i < told.size(); ++i) EXPECT_EQ(read[i].program.outputs, told[i]) << i;
}

TEST_F(SessionLogFile, WhereTheDrivesStandIsToldWhenTheyAreEnabled) {
  now_.q_setpoint = JointVec::Constant(2, 1.0 / 3);
  now_.q_measured = JointVec::Constant(2, 2.0 / 3);
  using State = DriveState;
  for (const State state :
       {State::kStarting, State::kEnabled, State::kEnabled, State::kQuickStop, State::kEnabled}) {
    now_.drives = state;
    log_->report(next());
  }
  const auto read = entries();
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].kind, Kind::kStands);
  EXPECT_EQ(read[0].period, 2u);
  EXPECT_EQ(read[0].program.q, now_.q_setpoint);
  EXPECT_EQ(read[0].q_measured, now_.q_measured);
  EXPECT_EQ(read[1].kind, Kind::kDrives);
  EXPECT_EQ(read[1].period, 4u);
  EXPECT_EQ(read[1].drives, State::kQuickStop);
  EXPECT_EQ(read[2].kind, Kind::kStands);
  EXPECT_EQ(read[2].period, 5u);
}

// At a reset a drive may be set up with all others enabled, or close its brake and open it again.
TEST_F(SessionLogFile, DrivesThatObeyedAndStartAgainAreTold) {
  using State = DriveState;
  for (const State state : {State::kStarting, State::kEnabled, State::kStarting, State::kStarting,
                            State::kEnabled, State::kOff, State::kStarting, State::kEnabled}) {
    now_.drives = state;
    log_->report(next());
  }
  const auto read = entries();
  ASSERT_EQ(read.size(), 5u);
  EXPECT_EQ(read[1].kind, Kind::kDrives);
  EXPECT_EQ(read[1].drives, State::kStarting);
  EXPECT_EQ(read[1].period, 3u);
  EXPECT_EQ(read[2].kind, Kind::kStands);
  EXPECT_EQ(read[2].period, 5u);
  EXPECT_EQ(read[3].drives, State::kOff);
  EXPECT_EQ(read[4].kind, Kind::kStands);
}

TEST_F(SessionLogFile, EveryStateInWhichDrivesObeyNobodyIsTold) {
  using State = DriveState;
  const State states[] = {State::kEnabled, State::kHoming, State::kFault,
                          State::kLost,    State::kOff,    State::kQuickStop};
  for (const State state : states) {
    now_.drives = state;
    log_->report(next());
    log_->report(next());
  }
  const auto read = entries();
  ASSERT_EQ(read.size(), std::size(states));
  for (std::size_t i = 1; i < std::size(states); ++i) {
    EXPECT_EQ(read[i].drives, states[i]) << i;
    EXPECT_EQ(read[i].period, 2 * i + 1) << i;
  }
}

TEST(SessionLog, DrivesOfEarlierLogsWereMeasuredWhereTheyWereTold) {
  const Session read = parse_session(
      "{\"machine\":\"m\",\"tools\":\"\",\"vars\":\"\"}\n"
      "{\"entry\":\"stands\",\"period\":1,\"q\":[3,4]}\n",
      "log");
  EXPECT_EQ(read.entries.at(0).q_measured, (JointVec(2) << 3, 4).finished());
}

// What the operator pressed is a command already; a fault that stays is told once.
TEST_F(SessionLogFile, FaultsAreToldWhenTheyCome) {
  now_.fault_joint = 2;
  for (const Fault fault : {Fault::kOk, Fault::kFollowingError, Fault::kFollowingError, Fault::kOk,
                            Fault::kEmergencyStop, Fault::kOk, Fault::kDriveLost}) {
    now_.fault = fault;
    log_->report(next());
  }
  const auto read = entries();
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read[0].kind, Kind::kFault);
  EXPECT_EQ(read[0].fault, Fault::kFollowingError);
  EXPECT_EQ(read[0].joint, 2);
  EXPECT_EQ(read[0].period, 2u);
  EXPECT_EQ(read[1].fault, Fault::kDriveLost);
  EXPECT_EQ(read[1].period, 7u);
}

TEST_F(SessionLogFile, InputsAreToldWhenOneChanges) {
  log_->report(next());
  now_.inputs = std::uint64_t{1} << 63 | 5;
  log_->report(next());
  log_->report(next());
  now_.probe = true;
  log_->report(next());
  now_.spindle_ready = false;
  log_->report(next());
  now_.spindle_turns = 0.25;
  log_->report(next());  // nothing follows the encoder
  now_.reads_encoder = true;
  now_.spindle_turns = 0.5;
  log_->report(next());
  log_->report(next());
  const auto read = entries();
  ASSERT_EQ(read.size(), 4u);
  const std::uint64_t periods[] = {2, 4, 5, 7};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read[i].kind, Kind::kInputs);
    EXPECT_EQ(read[i].period, periods[i]);
    EXPECT_EQ(read[i].inputs.digital, std::uint64_t{1} << 63 | 5);
    EXPECT_EQ(read[i].inputs.probe, i >= 1);
    EXPECT_EQ(read[i].inputs.spindle_ready, i < 2);
  }
  EXPECT_EQ(read[3].inputs.spindle_turns, 0.5);
}

TEST_F(SessionLogFile, AnswersSensorsAndShortQueuesAreTold) {
  log_->report(next());
  CycleReport input = next();
  input.answered = true;
  input.answer.value = -1;
  log_->report(input);
  CycleReport probe = next();
  probe.answered = true;
  probe.answer.value = 1;
  probe.answer.probe = true;
  probe.answer.q_contact = JointVec::LinSpaced(3, 1.0 / 3, 1);
  probe.answer.y_stand << 1, 2, 3, 4, 5, 1.0 / 7;
  log_->report(probe);
  CycleReport sensor = next();
  sensor.sensor = {0, 31.7};
  log_->report(sensor);
  CycleReport low = next();
  low.blocks_when_low = 17;
  log_->report(low);
  const auto read = entries();
  ASSERT_EQ(read.size(), 4u);
  EXPECT_EQ(read[0].kind, Kind::kAnswer);
  EXPECT_EQ(read[0].answer.value, -1);
  EXPECT_FALSE(read[0].answer.probe);
  EXPECT_TRUE(read[1].answer.probe);
  EXPECT_EQ(read[1].answer.q_contact, probe.answer.q_contact);
  EXPECT_EQ(read[1].answer.y_stand, probe.answer.y_stand);
  EXPECT_EQ(read[2].kind, Kind::kSensor);
  EXPECT_EQ(read[2].sensor.channel, 0);
  EXPECT_EQ(read[2].sensor.value, 31.7);
  EXPECT_EQ(read[3].kind, Kind::kLow);
  EXPECT_EQ(read[3].blocks, 17u);
  EXPECT_EQ(read[3].period, 5u);
}

TEST_F(SessionLogFile, FeaturesBelongToThePeriodOfTheLastReport) {
  FeatureDeflection circle;
  circle.line = 3;
  circle.last_line = 6;
  circle.circle = true;
  circle.size_mm = 20.5;
  circle.offset_mm = 0.1 / 3;
  circle.bending_mm = -0.02;
  circle.unknown = 0.25;
  now_.period = 8;
  log_->report(next());
  log_->features({circle, FeatureDeflection()});
  const auto read = entries();
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].period, 9u);
  ASSERT_EQ(read[0].features.size(), 2u);
  const FeatureDeflection& back = read[0].features[0];
  EXPECT_EQ(back.line, 3u);
  EXPECT_EQ(back.last_line, 6u);
  EXPECT_TRUE(back.circle);
  EXPECT_EQ(back.size_mm, 20.5);
  EXPECT_EQ(back.offset_mm, 0.1 / 3);
  EXPECT_EQ(back.bending_mm, -0.02);
  EXPECT_EQ(back.unknown, 0.25);
  EXPECT_FALSE(read[0].features[1].circle);
}

TEST_F(SessionLogFile, DamageIsNamedByItsLine) {
  const std::string head = R"({"machine":"m.toml","tools":"","vars":""})"
                           "\n";
  EXPECT_EQ(refusal(head), "") << "logs from before the files' texts were kept";
  EXPECT_EQ(refusal("").substr(0, 3), ":1:");
  EXPECT_EQ(refusal(R"({"machine":"","tools":"","vars":""})").substr(0, 3), ":1:");
  const auto bad = [&](const std::string& line) {
    return refusal(head + R"({"entry":"low","period":1,"blocks":2})" + "\n" + line + "\n").substr(0, 3);
  };
  EXPECT_EQ(bad("{"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"lower","period":1})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"low","period":1})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"fault","period":1,"fault":1000,"joint":0})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"fault","period":1,"fault":-1,"joint":0})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"features","period":1,"features":[{"line":1,"last_line":2,"feature":"circel",)"
                R"("size_mm":1,"bending_mm":0,"offset_mm":0,"unknown_share":0}]})"),
            ":3:");
  EXPECT_EQ(bad(R"({"entry":"fault","period":1,"fault":"following_eror","joint":0})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"sensor","period":1,"channel":16,"value":1})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"sensor","period":1,"channel":-1,"value":1})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"answer","period":1,"value":1,"contact":[1],"stands":[1,2,3,4,5]})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"stands","period":1,"q":[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]})"), ":3:");
  EXPECT_EQ(bad(R"({"entry":"sensor","period":1,"channel":15,"value":1})"), "");
}

TEST_F(SessionLogFile, WholeNumbersAreWholeAndFit) {
  const std::string head = R"({"machine":"m.toml","tools":"","vars":""})"
                           "\n";
  const auto refused = [&](const std::string& line) {
    return refusal(head + line + "\n").substr(0, 3) == ":2:";
  };
  for (const char* period : {"-1", "1.5", "2e19", "18446744073709551616", "true"}) {
    EXPECT_TRUE(refused(fmt::format(R"({{"entry":"low","period":{},"blocks":2}})", period))) << period;
    EXPECT_TRUE(refused(fmt::format(R"({{"entry":"low","period":1,"blocks":{}}})", period))) << period;
  }
  EXPECT_TRUE(refused(R"({"entry":"low","period":1,"blocks":4294967296})"));
  EXPECT_TRUE(refused(R"({"entry":"sensor","period":1,"channel":4294967299,"value":1})"));
  EXPECT_TRUE(refused(R"({"entry":"fault","period":1,"fault":"drive_lost","joint":2147483648})"));
  EXPECT_TRUE(refused(R"({"entry":"program","period":1,"path":"a","q":[],"corrections_off":256})"));
  EXPECT_TRUE(
      refused(R"({"entry":"features","period":1,"features":[{"line":-1,"last_line":2,"feature":"cut",)"
              R"("size_mm":1,"bending_mm":0,"offset_mm":0,"unknown_share":0}]})"));
  EXPECT_FALSE(refused(R"({"entry":"low","period":18446744073709551615,"blocks":4294967295})"));
}

// Earlier logs have the fault's number in place of its name.
TEST_F(SessionLogFile, AFaultMayStandThereAsItsNumber) {
  EXPECT_EQ(refusal(R"({"machine":"m.toml","tools":"","vars":""})"
                    "\n"
                    R"({"entry":"fault","period":1,"fault":6,"joint":1})"
                    "\n"),
            "");
  EXPECT_EQ(read_session(path_).entries.at(0).fault, Fault::kFollowingError);
  EXPECT_EQ(refusal(R"({"machine":"m.toml","tools":"","vars":""})"
                    "\n"
                    R"({"entry":"fault","period":1,"fault":0,"joint":-1})"
                    "\n"),
            "")
      << "the least";
}

// A power cut leaves part of a line.
TEST_F(SessionLogFile, ALastLineThatIsCutOffIsLeftOut) {
  const std::string whole = R"({"machine":"m.toml","tools":"","vars":""})"
                            "\n"
                            R"({"entry":"low","period":1,"blocks":2})"
                            "\n";
  const std::string last = R"({"entry":"low","period":2,"blocks":3})";
  for (std::size_t size = 1; size < last.size(); ++size) {
    const Session session = parse_session(whole + last.substr(0, size), "a.log");
    EXPECT_EQ(session.torn_line, 3) << size;
    EXPECT_EQ(session.entries.size(), 1u);
  }
  EXPECT_EQ(parse_session(whole + std::string(100, '\0'), "a.log").torn_line, 3)
      << "blocks that were never written";
  EXPECT_EQ(parse_session(whole + last, "a.log").entries.size(), 2u) << "all but the line's end is there";
  EXPECT_EQ(parse_session(whole, "a.log").torn_line, 0);
  EXPECT_THROW(parse_session(whole + last.substr(0, 9) + "\n" + last + "\n", "a.log"), ProgramError)
      << "not the last one";
  EXPECT_THROW(parse_session(whole.substr(0, 9), "a.log"), ProgramError) << "not even its head";
}

/// A disk that takes no more than the log has, and some bytes: files may not grow any more.
class FullDisk {
 public:
  explicit FullDisk(const std::string& log, std::size_t more) {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit full{std::filesystem::file_size(log) + more, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &full);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

TEST_F(SessionLogFile, AFullDiskIsToldOnceAndLeavesAMark) {
  const auto lose = [&](std::uint64_t period) {
    now_.period = period - 1;
    now_.inputs ^= 1;
    log_->report(next());
  };
  lose(10);
  {
    const FullDisk full(path_, 20);
    for (const std::uint64_t period : {11, 12, 13}) lose(period);
    const std::string told = log_->take_trouble();
    EXPECT_EQ(told.find(path_ + ": "), 0u) << told;
    EXPECT_NE(told.find("not recorded"), std::string::npos) << told;
    EXPECT_EQ(log_->take_trouble(), "") << "once";
    EXPECT_EQ(read_session(path_).torn_line, 0) << "nothing of a line stays";
  }
  lose(14);  // it tries again after a second
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  lose(15);
  EXPECT_EQ(log_->take_trouble(), "");
  const auto read = entries();
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].period, 10u);
  EXPECT_EQ(read[1].kind, Kind::kGap);
  EXPECT_EQ(read[1].since, 11u);
  EXPECT_EQ(read[1].period, 15u);
  EXPECT_EQ(read[1].lost, 4u);
  EXPECT_EQ(read[2].period, 15u);
}

TEST_F(SessionLogFile, OnADiskThatWasFullFromTheStartTheHeadComesLater) {
  log_.reset();
  std::ofstream(path_).close();
  {
    const FullDisk full(path_, 5);
    log_ = std::make_unique<SessionLog>(path_, SessionHead{"m.toml", "t.tbl", "v.var", true});
    EXPECT_NE(log_->take_trouble(), "");
    EXPECT_EQ(std::filesystem::file_size(path_), 0u);
  }
  const auto read = entries();  // its end marks the gap
  ASSERT_EQ(read.size(), 1u);
  EXPECT_EQ(read[0].kind, Kind::kGap);
  EXPECT_EQ(read[0].since, 0u);
}

// What the machine did is its owner's and the group's to read.
TEST_F(SessionLogFile, OthersMayNotReadIt) {
  const mode_t mask = umask(0);
  const std::string made = make_log_file(path_ + ".new");
  umask(mask);
  struct stat info {};
  ASSERT_EQ(stat(made.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777u, 0640u);
  std::filesystem::remove(made);
}

}  // namespace
}  // namespace trn
