#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <stdexcept>

#include "app/daemon/supervisor.h"
#include "core/fault.h"
#include "core/ports.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"
#include "tests/app/daemon/controller_bench.h"

// A stop that comes while the drives are brought up, and a reset that comes right behind a stop.
namespace trn {
namespace {

using controller_bench::Bench;
using trunnion::acknowledge_t;
using trunnion::command_t;
using Kind = RtCommand::Kind;

// The tick tells of an emergency stop in the period after it; on a busy host a reset is there before.
TEST(BringUpStop, AResetRightBehindAnEmergencyStopBringsTheMachineUp) {
  for (const Fault told : {Fault::kEmergencyStop, Fault::kDriveFault}) {
    Bench bench;
    ASSERT_EQ(bench.send(command_t::ESTOP).outcome, +acknowledge_t::ACCEPTED);
    ASSERT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
    ASSERT_EQ(bench.controller.state(), MachineState::kStarting);
    bench.now.fault = told;
    bench.tick();
    if (told == Fault::kDriveFault) {
      EXPECT_EQ(bench.controller.state(), MachineState::kFault) << "nobody has commanded this one";
      continue;
    }
    EXPECT_EQ(bench.controller.state(), MachineState::kStarting);
    bench.until([&] { return bench.last() == Kind::kResetFault; });
    bench.now.fault = Fault::kOk;
    bench.tick();
    EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
  }
}

// Drives on a bus need seconds to come up; a stop does not wait for them.
struct SlowDrives final : Drives {
  void bring_up() override {
    ++begun;
    if (!gate.valid()) return;
    gate.wait();
    if (fails) throw std::runtime_error("node 3 does not answer");
  }
  void shut_down() noexcept override {}
  void reset_faults() override {}
  void exchange(const Setpoints&, Feedback&) TRN_RT override {}
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override {}
  std::shared_future<void> gate;
  std::atomic<int> begun = 0;
  std::atomic<bool> fails = false;
};

TEST(BringUpStop, AStopWhileTheDrivesComeUpIsGivenAgainBehindThem) {
  for (const bool commanded : {true, false})
    for (const bool fails : {true, false}) {
      SlowDrives drives;
      Bench bench(drives);
      std::promise<void> gate;
      drives.gate = gate.get_future().share();
      drives.fails = fails;
      bench.now.fault = Fault::kDriveFault;
      bench.tick();
      bench.now.drives = DriveState::kOff;
      bench.tick();
      ASSERT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
      bench.until([&] { return drives.begun == 2; });
      const Kind kind = commanded ? Kind::kEmergencyStop : Kind::kQuickStop;
      if (commanded) bench.send(command_t::ESTOP);
      bench.now.fault = commanded ? Fault::kEmergencyStop : Fault::kDriveLost;
      bench.tick();
      EXPECT_EQ(bench.controller.state(), commanded ? MachineState::kEstop : MachineState::kFault);
      ASSERT_EQ(bench.last(), kind);
      const std::size_t before = bench.posted.size();
      gate.set_value();
      bench.until([&] { return bench.posted.size() > before; });
      EXPECT_EQ(bench.last(), kind) << "what came up goes down again";
      for (int i = 0; i < 50; ++i) bench.controller.poll();
      for (std::size_t i = 1; i < bench.posted.size(); ++i)
        EXPECT_NE(bench.posted[i].kind, Kind::kResetFault) << "the stop still holds";
      drives.fails = false;
      bench.tick();
      ASSERT_EQ(bench.send(command_t::RESET).outcome, +acknowledge_t::ACCEPTED);
      bench.until([&] { return bench.last() == Kind::kResetFault; });
      bench.now.fault = Fault::kOk;
      bench.now.drives = DriveState::kEnabled;
      bench.tick();
      EXPECT_EQ(bench.controller.state(), MachineState::kIdle);
    }
}

}  // namespace
}  // namespace trn
