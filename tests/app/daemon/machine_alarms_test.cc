#include <gtest/gtest.h>

#include <optional>

#include "app/daemon/machine_controller.h"
#include "app/daemon/supervisor.h"
#include "core/fault.h"
#include "core/motion.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"
#include "tests/app/daemon/controller_bench.h"

// What the controller tells of faults, failed programs and parts.
namespace trn {
namespace {

using controller_bench::Bench;
using trunnion::acknowledge_t;
using trunnion::command_t;

TEST(MachineController, AFaultIsAnAlarmUntilItIsResetAndAcknowledged) {
  Bench bench;
  std::optional<trunnion::alarms_t> alarms;
  bench.socket.client.subscribe<trunnion::alarms_t>(bench.lcm.alarms_channel(),
                                                    [&](const auto& message) { alarms = message; });
  bench.start_program();
  bench.now.line = 42;
  bench.tick();
  bench.now.fault = Fault::kFollowingError;
  bench.now.fault_joint = 0;
  bench.now.motion = MotionState::kRest;
  bench.tick();
  bench.until([&] { return alarms && alarms->alarm_count == 1; });
  EXPECT_EQ(alarms->alarm_name[0], "following_error");
  EXPECT_NE(alarms->alarm_text[0].find("joint X"), std::string::npos) << alarms->alarm_text[0];
  EXPECT_EQ(alarms->alarm_program[0], "part.ngc");
  EXPECT_EQ(alarms->alarm_line[0], 42);
  EXPECT_EQ(alarms->alarm_cause[0], "") << "nobody commanded it";
  EXPECT_TRUE(alarms->alarm_active[0]);
  EXPECT_EQ(bench.send(command_t::ACKNOWLEDGE, "", 1).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return bench.status->alarms_open == 0; });
  bench.until([&] { return alarms->alarm_acknowledged[0] != 0; });
  EXPECT_EQ(alarms->alarm_count, 1) << "it lasts";
  bench.now.fault = Fault::kOk;
  EXPECT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return alarms->alarm_count == 0; });
}

// Nothing has happened to the machine, so nobody has to acknowledge anything.
TEST(MachineController, WhatIsRefusedBeforeItRunsIsToldToWhoAskedAndIsNoAlarm) {
  Bench bench;
  const acknowledge_t load = bench.send(command_t::LOAD, "bad.ngc");
  EXPECT_EQ(load.outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(load.message, "bad.ngc:3:7: no such word");
  bench.until([&] { return bench.status && bench.status->message == load.message; });
  EXPECT_EQ(bench.status->program, "");
  bench.programs.bad_line = "mdi:1:6: no such word";
  const acknowledge_t typed = bench.send(command_t::MDI, "G1 X1O");
  EXPECT_EQ(typed.outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(typed.message, "mdi:1:6: no such word");
  bench.until([&] { return bench.controller.state() == MachineState::kIdle; });
  const std::int64_t count = bench.status->count;
  bench.until([&] { return bench.status->count > count + 1; });
  EXPECT_EQ(bench.status->alarms_open, 0);
  EXPECT_EQ(bench.status->message, load.message) << "a typed line that is refused changes nothing for others";
}

TEST(MachineController, AProgramThatFailsWhileItRunsIsAnAlarmWithItsNumber) {
  Bench bench;
  bench.start_program();
  bench.programs.failure = "part.ngc:3:7: no such word";
  bench.until([&] { return bench.status && bench.status->alarms_open == 1; });
  EXPECT_EQ(bench.status->alarm, "program: part.ngc:3:7: no such word");
  for (const double none : {2.0, -1.0, 0.5})
    EXPECT_EQ(bench.send(command_t::ACKNOWLEDGE, "", none).outcome, +acknowledge_t::REFUSED) << none;
  EXPECT_EQ(bench.send(command_t::ACKNOWLEDGE).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return bench.status->alarms_open == 0; });
}

TEST(MachineController, AToolIsTakenOutOfTheTableWhileTheMachineIsIdle) {
  Bench bench;
  bench.start_program();
  EXPECT_EQ(bench.send(command_t::DELETE_TOOL, "", 3).outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(bench.programs.deleted_tool, 0);
  bench.now.motion = MotionState::kRest;
  bench.tick();
  bench.until([&] { return bench.controller.state() == MachineState::kIdle; });
  EXPECT_EQ(bench.send(command_t::DELETE_TOOL, "", 9).message, "there is no tool 9 in the table");
  const acknowledge_t done = bench.send(command_t::DELETE_TOOL, "", 3);
  EXPECT_EQ(done.outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(done.message, "tool 3 is out of the table");
  EXPECT_EQ(bench.programs.deleted_tool, 3);
  EXPECT_FALSE(bench.programs.deleted_beside.empty()) << "the loaded program must run without it";
}

TEST(MachineController, APartIsAProgramThatCameToItsEnd) {
  Bench bench;
  const auto end = [&](bool whole) {
    bench.start_program();
    bench.now.event.kind = whole ? QueueEvent::Kind::kProgramEnd : QueueEvent::Kind::kNone;
    bench.tick();
    bench.now.event.kind = QueueEvent::Kind::kNone;
    bench.now.motion = MotionState::kRest;
    bench.tick();
    bench.until([&] { return bench.controller.state() == MachineState::kIdle; });
  };
  end(true);
  end(false);
  end(true);
  bench.until([&] { return bench.status && bench.status->parts == 2; });
  EXPECT_GT(bench.status->run_s, 0);
  EXPECT_EQ(bench.send(command_t::PARTS, "", 7).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return bench.status->parts == 7; });
}

}  // namespace
}  // namespace trn
