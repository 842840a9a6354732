#include "app/daemon/machine_controller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <random>
#include <utility>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/motion.h"
#include "hal/loopback.h"
#include "interp/move.h"
#include "tests/app/daemon/controller_bench.h"
#include "tests/app/daemon/socket_bench.h"
#include "tests/hal/hostile_datagrams.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

using controller_bench::Bench;
using controller_bench::HangingDrives;
using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;
using Kind = RtCommand::Kind;

TEST(MachineController, BringsTheDrivesUpAndBecomesIdle) {
  Bench bench;
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  bench.until([&] { return bench.status && bench.status->state == "idle"; });
  EXPECT_EQ(bench.status->warnings, std::vector<std::string>{"no real-time priority"});
  EXPECT_FALSE(bench.status->realtime);
}

TEST(MachineController, TellsItsStatusAgainWhereNothingChanges) {
  Bench bench;
  for (int i = 0; i < 3; ++i) {
    bench.status.reset();
    bench.until([&] { return bench.status.has_value(); });
    EXPECT_EQ(bench.status->state, "idle");
  }
}

TEST(MachineController, SwitchesTheCorrectionThatIsNamed) {
  Bench bench;
  for (const auto& [name, number] : {std::pair("growth", 0), std::pair("sag", 1)})
    for (const double value : {1.0, 0.0}) {
      EXPECT_EQ(bench.send(command_t::CORRECTION, name, value).outcome, +acknowledge_t::ACCEPTED);
      EXPECT_EQ(bench.last(), Kind::kCorrection);
      EXPECT_EQ(bench.posted.back().joint, number) << name;
      EXPECT_EQ(bench.posted.back().value, value) << name;
      EXPECT_EQ(bench.posted.back().speed, 0) << name;
    }
  const std::size_t before = bench.posted.size();
  const acknowledge_t answer = bench.send(command_t::CORRECTION, "growths", 1);
  EXPECT_EQ(answer.outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(answer.message.find("no correction 'growths'"), std::string::npos) << answer.message;
  EXPECT_EQ(bench.posted.size(), before);
}

TEST(MachineController, TellsWhatEachCorrectionDoes) {
  Bench bench;
  bench.now.corrections[0] = {JointVec::Constant(1, -0.25), true, ""};
  bench.now.corrections[1] = {JointVec::Constant(1, 0.125), false, "sensor t1 is silent"};
  bench.tick();
  bench.until([&] { return bench.status && bench.status->correction_warning.back() != ""; });
  EXPECT_EQ(bench.status->correction_count, 2);
  EXPECT_EQ(bench.status->correction_name, (std::vector<std::string>{"growth", "sag"}));
  EXPECT_EQ(bench.status->correction_offset, (std::vector<double>{0.25, 0.125})) << "the greatest size";
  EXPECT_TRUE(bench.status->correction_on[0]);
  EXPECT_FALSE(bench.status->correction_on[1]);
  EXPECT_EQ(bench.status->correction_warning, (std::vector<std::string>{"", "sensor t1 is silent"}));
}

TEST(MachineController, ACorrectionInThePlanIsSwitchedWhileTheMachineIsIdle) {
  const Assembly measured = assemble(source_dir() + "/configs/cradle_measured.toml");
  Bench bench(*measured.map);
  bench.until([&] { return bench.status.has_value(); });
  ASSERT_EQ(bench.status->correction_name, (std::vector<std::string>{"geometric", "growth", "sag"}));
  EXPECT_TRUE(bench.status->correction_on[0]);
  EXPECT_EQ(bench.status->correction_offset[0], 0) << "of those in the plan nothing is told";
  EXPECT_EQ(bench.send(command_t::CORRECTION, "geometric", 0).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.programs.switches_.corrections_off, kGeometricBit);
  bench.status.reset();
  bench.until([&] { return bench.status.has_value(); });
  EXPECT_FALSE(bench.status->correction_on[0]);
  bench.start_program();
  const acknowledge_t answer = bench.send(command_t::CORRECTION, "geometric", 1);
  EXPECT_EQ(answer.outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(answer.message.find("while the machine is idle"), std::string::npos) << answer.message;
  EXPECT_EQ(bench.programs.switches_.corrections_off, kGeometricBit);
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_EQ(bench.send(command_t::CORRECTION, "geometric", 1).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.programs.switches_.corrections_off, 0);
  EXPECT_EQ(bench.send(command_t::CORRECTION, "joint_table", 1).outcome, +acknowledge_t::REFUSED)
      << "this machine has none";
}

TEST(MachineController, RunsAProgramToItsEnd) {
  Bench bench;
  bench.start_program();
  EXPECT_EQ(bench.last(), Kind::kStart);
  EXPECT_EQ(bench.programs.loads, 1) << "what load prepared is started";
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  bench.send(command_t::START);
  EXPECT_EQ(bench.programs.loads, 2) << "a second start prepares it again";
}

TEST(MachineController, ReportsOfThePastDoNotEndTheMotion) {
  Bench bench;
  bench.send(command_t::LOAD, "part.ngc");
  bench.send(command_t::START);
  bench.now.motion = MotionState::kRest;
  bench.controller.report(bench.now);  // from before the tick heard of the start
  EXPECT_EQ(bench.controller.state(), MachineState::kRunning);
}

TEST(MachineController, BadProgramIsToldAndNothingStarts) {
  Bench bench;
  const acknowledge_t answer = bench.send(command_t::LOAD, "bad.ngc");
  EXPECT_EQ(answer.outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(answer.message, "bad.ngc:3:7: no such word");
  EXPECT_EQ(bench.send(command_t::START).outcome, +acknowledge_t::REFUSED);
  for (const RtCommand& command : bench.posted) EXPECT_NE(command.kind, Kind::kStart);
}

// The way to the line is shown first; the start that follows drives that way and no other.
TEST(MachineController, AStartFromALineIsPreparedFromWhereTheMachineStands) {
  Bench bench;
  EXPECT_EQ(bench.send(command_t::LOAD, "", 12).outcome, +acknowledge_t::REFUSED) << "nothing is loaded";
  bench.send(command_t::LOAD, "part.ngc");
  const acknowledge_t shown = bench.send(command_t::LOAD, "", 12);
  EXPECT_EQ(shown.outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(shown.message, "approach");
  EXPECT_EQ(bench.programs.from_line, 12U);
  bench.now.q_plan = JointVec::Constant(1, 5.0);
  bench.tick();
  EXPECT_EQ(bench.send(command_t::START).outcome, +acknowledge_t::REFUSED) << "the machine has moved";
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  bench.send(command_t::LOAD, "", 12);
  EXPECT_EQ(bench.send(command_t::START).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.last(), Kind::kStart);
}

TEST(MachineController, HoldResumeStop) {
  Bench bench;
  bench.start_program();
  bench.send(command_t::HOLD);
  EXPECT_EQ(bench.last(), Kind::kHold);
  bench.now.motion = MotionState::kHeld;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kHolding);
  bench.send(command_t::RESUME);
  EXPECT_EQ(bench.last(), Kind::kResume);
  bench.send(command_t::STOP);
  EXPECT_EQ(bench.last(), Kind::kStop);
  EXPECT_EQ(bench.programs.abandoned, 2) << "by the load, and by the stop";
  EXPECT_EQ(bench.controller.state(), MachineState::kStopping);
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
}

// What was read ahead is taken back when the machine stands, to the block in which it does.
TEST(MachineController, AProgramThatIsGivenUpIsTakenBack) {
  for (const bool fault : {false, true}) {
    Bench bench;
    bench.start_program();
    bench.now.step = 3;
    bench.tick();
    if (fault) {
      bench.now.fault = Fault::kDriveFault;
      bench.tick();
    } else {
      ASSERT_EQ(bench.send(command_t::STOP).outcome, +acknowledge_t::ACCEPTED);
      bench.now.step = 4;  // on its way to rest
      bench.tick();
    }
    bench.controller.poll();
    EXPECT_EQ(bench.programs.given_up, 0) << "it does not stand yet";
    bench.now.motion = MotionState::kRest;
    bench.now.step = 0;
    bench.tick();
    if (fault) {
      ASSERT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
      bench.until([&] { return bench.last() == Kind::kResetFault; });
      bench.now.fault = Fault::kOk;
      bench.tick();
    }
    bench.until(
        [&] { return bench.controller.state() == MachineState::kIdle && bench.programs.given_up > 0; });
    EXPECT_EQ(bench.programs.gave_up_block, fault ? 30u : 40u);
    EXPECT_EQ(bench.programs.given_up, 1);
  }
}

// Whoever waits for the end of a stop reads the tables then.
TEST(MachineController, ItIsIdleWhenWhatWasReadAheadIsTakenBack) {
  Bench bench;
  std::promise<void> disk;
  bench.programs.slow_disk = disk.get_future().share();
  bench.start_program();
  ASSERT_EQ(bench.send(command_t::STOP).outcome, +acknowledge_t::ACCEPTED);
  bench.now.motion = MotionState::kRest;
  bench.tick();
  ASSERT_EQ(bench.controller.state(), MachineState::kIdle);
  for (int heard = 0; heard < 2; ++heard) {
    bench.status.reset();
    bench.until([&] { return bench.status.has_value(); });
    EXPECT_EQ(bench.status->state, "stopping");
    EXPECT_EQ(bench.programs.given_up, 0);
  }
  disk.set_value();
  bench.until([&] { return bench.status->state == "idle"; });
  EXPECT_EQ(bench.programs.given_up, 1);
}

TEST(MachineController, AProgramThatHasEndedIsNotTakenBack) {
  Bench bench;
  bench.start_program();
  bench.now.event.kind = QueueEvent::Kind::kProgramEnd;
  bench.tick();
  bench.now.event = {};
  bench.now.motion = MotionState::kRest;
  bench.tick();
  ASSERT_EQ(bench.controller.state(), MachineState::kIdle);
  bench.send(command_t::STOP);
  bench.start_program();
  bench.now.event.kind = QueueEvent::Kind::kProgramEnd;
  bench.tick();
  bench.now.event = {};
  bench.send(command_t::STOP);  // in the moment of its end
  bench.now.motion = MotionState::kRest;
  bench.tick();
  for (int i = 0; i < 20; ++i) bench.controller.poll();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  EXPECT_EQ(bench.programs.given_up, 0);
}

TEST(MachineController, QuickFaultStopsTheDrivesAndNamesTheJoint) {
  Bench bench;
  bench.start_program();
  bench.now.fault = Fault::kDriveFault;
  bench.now.fault_joint = 0;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kFault);
  EXPECT_EQ(bench.last(), Kind::kQuickStop);
  bench.until([&] { return bench.status && bench.status->state == "fault"; });
  EXPECT_EQ(bench.status->fault, "drive_fault");
  EXPECT_EQ(bench.status->fault_joint, "X");
  EXPECT_EQ(bench.send(command_t::START).outcome, +acknowledge_t::FAULT);
  EXPECT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return bench.last() == Kind::kResetFault; });
  bench.now.fault = Fault::kOk;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
}

TEST(MachineController, AFaultThatIsBackInThePeriodOfTheResetIsAFault) {
  Bench bench;
  bench.now.fault = Fault::kBusOff;
  bench.now.drives = DriveState::kLost;
  bench.tick();
  ASSERT_EQ(bench.controller.state(), MachineState::kFault);
  EXPECT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
  ASSERT_EQ(bench.controller.state(), MachineState::kStarting);
  bench.until([&] { return bench.last() == Kind::kResetFault; });
  bench.tick();  // no report without it in between
  EXPECT_EQ(bench.controller.state(), MachineState::kFault) << "else no command would ever be legal again";
}

TEST(MachineController, LateErrorIsShownWhenThePlanHasRunOut) {
  Bench bench;
  bench.start_program();
  bench.programs.failure = "part.ngc:900:1: unknown word";
  bench.now.motion = MotionState::kRest;
  bench.tick();
  bench.until([&] { return bench.status && bench.status->program_failed; });
  EXPECT_EQ(bench.status->message, "part.ngc:900:1: unknown word");
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
}

TEST(MachineController, TheToolIsKeptBeforeTheProgramGoesOn) {
  Bench bench;
  bench.start_program();
  bench.now.motion = MotionState::kPaused;
  bench.now.waits_at = {QueueEvent::Kind::kToolChange, kToolByOperator, 7, {}, 0};
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kHolding);
  bench.until(
      [&] { return bench.status && bench.status->waits_for.starts_with("tool 7 (ball): put it into"); });
  const acknowledge_t twice = bench.send(command_t::START);
  EXPECT_EQ(twice.outcome, +acknowledge_t::REFUSED) << "as of a double click";
  EXPECT_NE(twice.message.find("'resume' says that it is in the spindle"), std::string::npos);
  EXPECT_EQ(bench.programs.in_spindle, 0);
  bench.programs.disk_full = true;
  const acknowledge_t full = bench.send(command_t::RESUME);
  EXPECT_NE(full.outcome, +acknowledge_t::ACCEPTED);
  EXPECT_NE(full.message.find("No space left"), std::string::npos);
  EXPECT_NE(bench.last(), Kind::kResume);
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kHolding) << "it still waits";
  bench.programs.disk_full = false;
  EXPECT_EQ(bench.send(command_t::RESUME).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.programs.in_spindle, 7);
  EXPECT_EQ(bench.last(), Kind::kResume);
  bench.now.motion = MotionState::kMoving;
  bench.now.waits_at = {};
  bench.tick();
  bench.until([&] { return bench.status->waits_for.empty(); });
  EXPECT_EQ(bench.controller.state(), MachineState::kRunning);
}

// Away on a jog the joints do not stand: that is what is said, whatever else would keep the next jog.
TEST(MachineController, WhileAHeldMachineMovesAJogIsToldToWait) {
  Bench bench;
  bench.start_program();
  ASSERT_EQ(bench.send(command_t::HOLD).outcome, +acknowledge_t::ACCEPTED);
  bench.tick();
  ASSERT_EQ(bench.controller.state(), MachineState::kHolding);
  bench.now.stands_in_hold = false;
  bench.now.detour_full = true;
  bench.tick();
  const acknowledge_t moves = bench.send(command_t::JOG, "X", 1);
  EXPECT_EQ(moves.outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(moves.message.find("stand"), std::string::npos) << moves.message;
  EXPECT_EQ(moves.message.find("no room"), std::string::npos) << moves.message;
  bench.now.stands_in_hold = true;
  bench.tick();
  const acknowledge_t full = bench.send(command_t::JOG, "X", 1);
  EXPECT_NE(full.message.find("no room"), std::string::npos) << full.message;
}

TEST(MachineController, HoldEndsAJog) {
  Bench bench;
  EXPECT_EQ(bench.send(command_t::JOG, "", 10).outcome, +acknowledge_t::ACCEPTED);
  bench.now.motion = MotionState::kJogging;
  bench.tick();
  EXPECT_EQ(bench.send(command_t::HOLD).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.last(), Kind::kStop);
  EXPECT_EQ(bench.send(command_t::HOLD).outcome, +acknowledge_t::ACCEPTED) << "again, while it slows down";
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
}

TEST(MachineController, AJogThatIsCutShortSaysSo) {
  Bench bench;
  bench.now.q_plan = JointVec::Constant(1, 90.0);
  bench.tick();
  acknowledge_t answer = bench.send(command_t::JOG, "", 25);
  EXPECT_EQ(answer.outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(answer.message, "X stops at its limit, 100.0000 mm: 10.0000 mm instead of 25.0000");
  bench.tick();
  bench.now.q_plan = JointVec::Constant(1, 100.0);
  bench.tick();
  const std::size_t before = bench.posted.size();
  answer = bench.send(command_t::JOG, "X", 1);
  EXPECT_EQ(answer.outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(answer.message.find("stands at its limit, 100.0000 mm"), std::string::npos) << answer.message;
  EXPECT_EQ(bench.posted.size(), before);
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  EXPECT_EQ(bench.send(command_t::JOG, "X", -1).outcome, +acknowledge_t::ACCEPTED);
}

TEST(MachineController, AFailedLoadLeavesTheProgramBefore) {
  Bench bench;
  bench.send(command_t::LOAD, "part.ngc");
  bench.send(command_t::LOAD, "bad.ngc");
  bench.status.reset();
  bench.until([&] { return bench.status.has_value(); });
  EXPECT_EQ(bench.status->program, "part.ngc") << "as start sees it";
  EXPECT_EQ(bench.status->message, "bad.ngc:3:7: no such word");
  bench.send(command_t::LOAD, "part.ngc");
  bench.status.reset();
  bench.until([&] { return bench.status.has_value(); });
  EXPECT_EQ(bench.status->message, "");
  EXPECT_EQ(bench.status->program, "part.ngc");
}

TEST(MachineController, NonsenseValuesAreRefused) {
  Bench bench;
  EXPECT_EQ(bench.send(99).outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(bench.send(command_t::OVERRIDE, "", 2.01).outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(bench.send(command_t::OVERRIDE, "", std::nan("")).outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(bench.send(command_t::OVERRIDE, "", 0.5).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.posted.back().value, 0.5);
  EXPECT_EQ(bench.send(command_t::RAPID_OVERRIDE, "", 1.5).outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(bench.send(command_t::RAPID_OVERRIDE, "", 0.25).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.last(), Kind::kRapidOverride);
  EXPECT_EQ(bench.send(command_t::SINGLE_BLOCK, "", 1).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.last(), Kind::kSingleBlock);
}

TEST(MachineController, EndsMotionThenDrivesThenItself) {
  Bench bench;
  bench.start_program();
  bench.controller.terminate();
  EXPECT_EQ(bench.last(), Kind::kStop);
  bench.tick();
  EXPECT_FALSE(bench.controller.done());
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_FALSE(bench.controller.done()) << "the drives are still on";
  bench.now.drives = DriveState::kOff;
  bench.tick();
  bench.until([&] { return bench.controller.done(); });
  EXPECT_EQ(bench.controller.bad_ending(), "");
  EXPECT_FALSE(bench.controller.hangs());
}

// As when a contactor falls: the operator must not read "fault: ok".
TEST(MachineController, DrivesThatAreOffWithoutAFaultAreNamed) {
  Bench bench;
  bench.start_program();
  bench.now.drives = DriveState::kOff;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kFault);
  bench.until([&] { return bench.status && bench.status->state == "fault"; });
  EXPECT_EQ(bench.status->fault, "drive_dropped");
}

/// Lets go whoever waits at the gate, at the latest when the test is over.
struct Release {
  explicit Release(std::promise<void>& gate_in) : gate(gate_in) {}
  ~Release() { gate.set_value(); }
  Release(const Release&) = delete;
  Release& operator=(const Release&) = delete;
  std::promise<void>& gate;
};

TEST(MachineController, AProgramThatHangsKeepsNobodyFromTheMachine) {
  std::promise<void> gate;
  Bench bench;
  const Release release(gate);
  bench.programs.hangs = gate.get_future().share();
  command_t load{};
  load.client = 6;
  load.verb = command_t::LOAD;
  load.text = "/dead/share.ngc";
  bench.socket.client.publish(bench.lcm.command_channel(), load);
  bench.until([&] { return bench.programs.hanging.load(); });
  EXPECT_EQ(bench.send(command_t::JOG, "", 1).outcome, +acknowledge_t::ACCEPTED);
  bench.now.motion = MotionState::kJogging;
  bench.tick();
  bench.now.motion = MotionState::kRest;
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  EXPECT_EQ(bench.send(command_t::ESTOP).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.last(), Kind::kEmergencyStop);
  bench.tick();
  EXPECT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
  bench.until([&] { return bench.last() == Kind::kResetFault; });
  bench.tick();
  EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  bench.controller.terminate();
  bench.tick();
  bench.now.drives = DriveState::kOff;
  bench.tick();
  bench.until([&] { return bench.controller.done(); });
  EXPECT_EQ(bench.controller.bad_ending(), "") << "the drives are off";
  EXPECT_TRUE(bench.controller.hangs()) << "and the process cannot wait for the program";
}

TEST(MachineController, DrivesThatDoNotSwitchOffAreToldOf) {
  std::promise<void> gate;
  HangingDrives drives(gate.get_future().share());
  Bench bench(drives);
  const Release release(gate);
  bench.controller.terminate();
  bench.tick();
  bench.now.drives = DriveState::kOff;
  bench.tick();
  const auto begun = std::chrono::steady_clock::now();
  while (!bench.controller.done()) bench.controller.poll();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
  EXPECT_NE(bench.controller.bad_ending().find("did not answer"), std::string::npos);
  EXPECT_TRUE(bench.controller.hangs());
}

// The tick hears nothing: what is acknowledged as obeyed is what it was given, and an emergency stop has
// room.
TEST(MachineController, AFloodFillsNoRing) {
  Bench bench;
  const std::size_t before = bench.posted.size();
  command_t command{};
  command.client = 7;
  command.verb = command_t::OVERRIDE;
  for (command.sequence = 1; command.sequence <= 1000; ++command.sequence) {
    command.value = command.sequence % 2 ? 0.5 : 0.6;
    bench.socket.client.publish(bench.lcm.command_channel(), command);
    bench.socket.pump();
    bench.controller.poll();
  }
  const auto obeyed = [&] {
    return std::count_if(bench.answers.begin(), bench.answers.end(), [](const acknowledge_t& answer) {
      return answer.client == 7 && answer.outcome == acknowledge_t::ACCEPTED;
    });
  };
  EXPECT_EQ(static_cast<std::ptrdiff_t>(bench.posted.size() - before), obeyed());
  EXPECT_LE(bench.posted.size() - before, 16u);
  for (int i = 0; i < 300; ++i) bench.send(command_t::ESTOP);
  EXPECT_EQ(bench.last(), Kind::kEmergencyStop);
  EXPECT_LE(bench.posted.size() - before, 17u) << "said once";
  bench.tick();
  bench.controller.poll();
  EXPECT_LE(obeyed(), 16) << "what waited is given up";
}

// Short: 20,000; TRN_LONG: as many as it says.
TEST(MachineController, HostilePacketsEndNothing) {
  Bench bench;
  std::mt19937_64 random(4);
  for (int i = 0; i < hostile::count(); ++i) {
    const hostile::Bytes packet = hostile::datagram(random);
    if (!packet.empty()) bench.socket.client.send_packet(packet);  // an empty one is a client's farewell
    bench.socket.pump();
    if (i % 7 == 0) bench.tick();
    bench.controller.poll();
    bench.answers.clear();
  }
  EXPECT_FALSE(bench.socket.client.closed());
  bench.until([&] { return bench.status.has_value(); });
  bench.send(command_t::ESTOP);
  EXPECT_EQ(bench.controller.state(), MachineState::kEstop);
}

// The machine goes on meanwhile; the answer says from which line on it acts.
TEST(MachineController, BlockDeleteIsSwitchedWhileAProgramRuns) {
  Bench bench;
  bench.start_program();
  acknowledge_t answer = bench.send(command_t::BLOCK_DELETE, "", 1);
  EXPECT_EQ(answer.outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(answer.message,
            "lines with / are skipped behind line 12 of part.ngc; those before it were read already");
  EXPECT_TRUE(bench.programs.switches_.block_delete);
  EXPECT_EQ(bench.controller.state(), MachineState::kRunning);
  bench.until([&] { return bench.status && bench.status->block_delete; });
  EXPECT_EQ(bench.status->message, answer.message);
  bench.programs.no_switch = true;
  answer = bench.send(command_t::BLOCK_DELETE, "", 0);
  EXPECT_EQ(answer.outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(answer.message, "part.ngc:9:1: X is too far");
  EXPECT_TRUE(bench.programs.switches_.block_delete) << "as it was";
  EXPECT_EQ(bench.controller.state(), MachineState::kRunning);
}

}  // namespace
}  // namespace trn
