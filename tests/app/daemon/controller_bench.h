#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/daemon/machine_controller.h"
#include "app/daemon/program_source.h"
#include "app/daemon/realtime.h"
#include "app/daemon/supervisor.h"
#include "app/session/pipeline.h"
#include "app/session/place_record.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"
#include "hal/loopback.h"
#include "interp/gcode/program_config.h"
#include "interp/move.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"
#include "kernel/tick_port.h"
#include "tests/app/daemon/socket_bench.h"

// A controller whose programs, drives and tick are played by the test.
namespace trn::controller_bench {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;
using Kind = RtCommand::Kind;

inline constexpr char kMachine[] = R"(
[machine]
name = "bench"
period_s = 0.001
[[joint]]
name = "X"
type = "linear"
min_mm = -100
max_mm = 100
velocity_mm_s = 100
acceleration_mm_s2 = 1000
jerk_mm_s3 = 20000
)";

struct FakePrograms final : ProgramSource {
  std::string load(const std::string& path, const JointVec&) override {
    if (hangs.valid()) {
      hanging = true;
      hangs.wait();
    }
    if (path == "bad.ngc") throw ProgramError("bad.ngc:3:7: no such word");
    ++loads;
    return "";
  }
  std::string load_from(const std::string& path, const JointVec& q, std::uint32_t line) override {
    load(path, q);
    from_line = line;
    return "approach";
  }
  std::string load_place(const PlaceRecord&, const JointVec&, double) override { return ""; }
  void check_place(const PlaceRecord&, const JointVec&) override {}
  void delete_tool(int number, const std::string& path, const JointVec&) override {
    if (number == 9) throw ProgramError("there is no tool 9 in the table");
    deleted_tool = number;
    deleted_beside = path;
  }
  std::atomic<int> deleted_tool = 0;
  std::string deleted_beside;
  void load_mdi(const std::string&, const JointVec&) override {
    if (!bad_line.empty()) throw ProgramError(bad_line);
    ++mdis;
  }
  void confirm_tool(int number) override {
    if (disk_full) throw std::runtime_error("m.var: cannot be written: No space left on device");
    in_spindle = number;
  }
  std::string tool_name(int number) const override { return "tool " + std::to_string(number) + " (ball)"; }
  void set_switches(const ProgramSwitches& switches) override { switches_ = switches; }
  ProgramSwitches switches() const override { return switches_; }
  ReadingPlace switch_block_delete(bool on) override {
    if (no_switch) throw ProgramError("part.ngc:9:1: X is too far");
    switches_.block_delete = on;
    return {17, 12, "/parts/part.ngc"};
  }
  HeldLines obey_held(const std::string& text, const JointVec&) override {
    if (no_switch) throw ProgramError("part.ngc:9:1: X is too far");
    held_text = text;
    return {17, text, {}};
  }
  const ProgramStep* step(std::uint32_t number) override {
    at.block = 10 * number;
    return &at;
  }
  void gave_up_at(std::uint64_t block) override {
    if (slow_disk.valid()) slow_disk.wait();
    gave_up_block = block;
    ++given_up;
  }
  ProgramStep at;
  std::atomic<std::uint64_t> gave_up_block = 0;
  std::atomic<int> given_up = 0;
  std::string held_text;
  std::atomic<bool> no_switch = false;
  ProgramSwitches switches_;
  void abandon() override { ++abandoned; }
  std::string take_failure() override { return std::exchange(failure, ""); }
  std::atomic<int> loads = 0, mdis = 0, in_spindle = 0;
  std::atomic<bool> disk_full = false;
  int abandoned = 0;
  std::uint32_t from_line = 0;
  std::string failure, bad_line;
  std::shared_future<void> hangs, slow_disk;
  std::atomic<bool> hanging = false;
};

/// Drives that do not answer when they are switched off.
struct HangingDrives final : Drives {
  explicit HangingDrives(std::shared_future<void> gate_in) : gate(std::move(gate_in)) {}
  void bring_up() override {}
  void shut_down() noexcept override { gate.wait(); }
  void reset_faults() override {}
  void exchange(const Setpoints&, Feedback&) TRN_RT override {}
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override {}
  std::shared_future<void> gate;
};

struct FakeTick final : TickPort {
  void tick() TRN_RT override {}
  void latch(Fault) TRN_RT override {}
  bool post(const RtCommand& command) override {
    posted.push_back(command);
    return true;
  }
  bool next_report(CycleReport&) override { return false; }
  std::vector<RtCommand> posted;
};

/// Asks for nothing; the test says what it reports.
struct IdleCorrection final : SetpointCorrection {
  void wanted(const CorrectionInput&, JointVec& offset) TRN_RT override { offset.setZero(); }
  unsigned joint_mask() const override { return 1; }
};

/// Two corrections behind the plan.
struct Chain {
  explicit Chain(const Machine& machine) : chain(machine.joints, machine.period_s) {
    chain.append({"growth", true, 0.1, 0, 0.01, 4}, std::make_unique<IdleCorrection>());
    chain.append({"sag", false, 0.1, 0, 0.01, 8}, std::make_unique<IdleCorrection>());
  }
  SetpointChain chain;
};

/// A controller whose tick is played by the test: reports are made by hand, commands to the tick are kept.
struct Bench {
  Bench() : Bench(loopback_drives) {}
  explicit Bench(const MachineJointMap& map_in) : Bench(loopback_drives, &map_in) {}
  explicit Bench(Drives& drives_in, const MachineJointMap* map_in = nullptr)
      : map(map_in), drives(drives_in) {
    socket.client.subscribe<acknowledge_t>(lcm.acknowledge_channel(),
                                           [this](const auto& answer) { answers.push_back(answer); });
    socket.client.subscribe<status_t>(lcm.status_channel(),
                                      [this](const auto& message) { status = message; });
    now.q_plan = now.q_setpoint = now.q_measured = JointVec::Zero(1);
    now.homed_mask = 1;
    controller.begin();
    until([this] { return !posted.empty(); });
    now.drives = DriveState::kEnabled;
    tick();
  }
  void until(const std::function<bool()>& wanted) {
    for (int i = 0; i < 2000 && !wanted(); ++i) {
      controller.poll();
      if (!posted.empty() && (last() == Kind::kStop || last() == Kind::kQuickStop)) tick();
      socket.server.handle(1);
      socket.pump();
    }
    ASSERT_TRUE(wanted());
  }
  /// The tick has heard everything and reports what stands in `now`.
  void tick() {
    now.last_command_id = posted.empty() ? 0 : posted.back().id;
    controller.report(now);
  }
  acknowledge_t send(std::int8_t verb, const std::string& text = "", double value = 0) {
    command_t command{};
    command.client = 5;
    command.sequence = ++sequence;
    command.verb = verb;
    command.text = text;
    command.value = value;
    socket.client.publish(lcm.command_channel(), command);
    until([&] {
      return !answers.empty() && answers.back().sequence == sequence &&
             answers.back().outcome != acknowledge_t::WORKING;
    });
    return answers.back();
  }
  void start_program() {
    ASSERT_EQ(send(command_t::LOAD, "part.ngc").outcome, +acknowledge_t::ACCEPTED);
    ASSERT_EQ(send(command_t::START).outcome, +acknowledge_t::ACCEPTED);
    now.motion = MotionState::kMoving;
    tick();
    ASSERT_EQ(controller.state(), MachineState::kRunning);
  }
  Kind last() const { return posted.back().kind; }

  Machine machine = read_machine(parse_config(kMachine, "bench.toml"));
  LcmConfig lcm{"", "bench"};
  SocketBench socket;
  LcmPublisher telemetry{lcm.url};
  LoopbackDrives loopback_drives{JointVec::Zero(1)};
  const MachineJointMap* map;
  Drives& drives;
  FakePrograms programs;
  LoopStatistics statistics;
  FakeTick fake_tick;
  std::vector<RtCommand>& posted = fake_tick.posted;
  std::vector<acknowledge_t> answers;
  std::optional<status_t> status;
  CycleReport now;
  int sequence = 0;
  Chain corrections{machine};
  MachineController controller{{machine, lcm, socket.server, socket.access, telemetry, drives, fake_tick,
                                programs, statistics, nullptr, map, &corrections.chain},
                               {"no real-time priority"}};
};

}  // namespace trn::controller_bench
