#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/realtime.h"
#include "core/signal_name.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "kernel/safety_inputs.h"
#include "kernel/signal_wires.h"
#include "tests/support/paths.h"

// What the tick tells wires and safety inputs of the machine's states, for every state that a machine has.
namespace trn {
namespace {

using Kind = RtCommand::Kind;
constexpr int kDoorInput = 5;

/// Inputs by hand, and the outputs as they were told.
class Devices final : public MachineIo {
 public:
  void exchange(const IoOutputs& outputs, const IoPlace&, IoInputs& now) TRN_RT override {
    told = outputs;
    now = inputs;
  }
  IoOutputs told;
  IoInputs inputs;
};

/// A mill whose states are wired to the outputs of their numbers.
class WiredMill {
 public:
  explicit WiredMill(std::vector<SafetyInputs::Input> safety = {})
      : assembly_(assemble(source_dir() + "/configs/mill.toml")),
        queue_(1 << 14),
        cycle_(config(std::move(safety)), {*assembly_.map, queue_, *assembly_.drives, *assembly_.rate_plans,
                                           assembly_.corrections.setpoint.get(), &devices}) {
    devices.inputs.digital = 1u << kDoorInput;
    assembly_.drives->bring_up();
    until([this] { return now().drives == DriveState::kEnabled; });
  }
  void start(const std::string& program) {
    pipeline_.emplace(assembly_, parameters_, tools_, ProgramStart{"test", program, now().q_plan},
                      PipelineObservers{});
    MotionBlock block;
    while (pipeline_->next(block)) queue_.push(block);
    cycle_.post({Kind::kStart});
  }
  bool until(const std::function<bool()>& wanted) {
    for (int i = 0; i < 20000 && !wanted(); ++i) cycle_.tick();
    return wanted();
  }
  /// Two periods: that of the command, and that in which the wires' ends are told.
  void tell(const RtCommand& command) {
    cycle_.post(command);
    run(2);
  }
  void run(int periods) {
    for (int i = 0; i < periods; ++i) cycle_.tick();
  }
  bool on(MachineSignal signal) const { return devices.told.digital >> static_cast<unsigned>(signal) & 1; }
  void open_door() { devices.inputs.digital = 0; }
  const CycleReport& now() const { return cycle_.last_report(); }

  Devices devices;

 private:
  CycleConfig config(std::vector<SafetyInputs::Input> safety) const {
    CycleConfig out = cycle_config(assembly_, ProgramStops::kWait);
    out.safety = std::move(safety);
    for (int i = 0; i < static_cast<int>(MachineSignal::kCount); ++i) {
      SignalWires::Wire wire;
      wire.from = {SignalName::Kind::kMachine, -1, i};
      wire.to = {SignalName::Kind::kIoOutput, -1, i};
      out.wires.push_back(wire);
    }
    return out;
  }

  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_;
  MotionQueue queue_;
  Cycle cycle_;
  std::optional<Pipeline> pipeline_;
};

constexpr const char* kStopsBetween = "G21 G90\nG1 X10 F3000\nM0\nX20\nM2\n";

TEST(CycleWiring, RunningIsAProgramThatMovesOrIsHeldOrPaused) {
  WiredMill mill;
  mill.run(5);
  EXPECT_FALSE(mill.on(MachineSignal::kRunning)) << "it rests";
  EXPECT_FALSE(mill.on(MachineSignal::kMoving)) << "it rests";
  EXPECT_TRUE(mill.on(MachineSignal::kEnabled));
  mill.tell({Kind::kJog, 5, 0, 0});
  mill.run(20);
  ASSERT_EQ(mill.now().motion, MotionState::kJogging);
  EXPECT_FALSE(mill.on(MachineSignal::kRunning)) << "it is jogged";
  EXPECT_TRUE(mill.on(MachineSignal::kMoving)) << "it is jogged";
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kRest; }));
  mill.start(kStopsBetween);
  mill.run(100);
  ASSERT_GT(mill.now().speed_mm_s, 10);
  EXPECT_TRUE(mill.on(MachineSignal::kRunning)) << "it moves";
  EXPECT_TRUE(mill.on(MachineSignal::kMoving)) << "it moves";
  mill.tell({Kind::kHold});
  ASSERT_TRUE(mill.until([&] { return mill.now().stands_in_hold; }));
  ASSERT_EQ(mill.now().motion, MotionState::kHeld);
  EXPECT_TRUE(mill.on(MachineSignal::kRunning)) << "it is held";
  mill.tell({Kind::kResume});
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kPaused; }));
  mill.run(2);
  EXPECT_TRUE(mill.on(MachineSignal::kRunning)) << "it is paused";
  EXPECT_FALSE(mill.on(MachineSignal::kMoving)) << "it is paused";
  mill.tell({Kind::kResume});
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kRest; }));
  mill.run(2);
  EXPECT_FALSE(mill.on(MachineSignal::kRunning)) << "it has ended";
  EXPECT_EQ(mill.now().fault, Fault::kOk);
}

SafetyInputs::Input door(bool stops_jogs) {
  SafetyInputs::Input out;
  out.kind = SafetyKind::kDoor;
  out.from = {SignalName::Kind::kIoInput, -1, kDoorInput};
  out.stops_jogs = stops_jogs;
  return out;
}

TEST(CycleWiring, ADoorThatLetsTheOperatorJogStopsProgramsAlone) {
  WiredMill mill({door(false)});
  mill.open_door();
  mill.tell({Kind::kJog, 5, 0, 0});
  mill.run(50);
  EXPECT_EQ(mill.now().motion, MotionState::kJogging);
  EXPECT_EQ(mill.now().fault, Fault::kOk) << "a jog at rest";
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kRest; }));
  EXPECT_EQ(mill.now().fault, Fault::kOk);
  mill.start(kStopsBetween);
  mill.run(3);
  EXPECT_EQ(mill.now().fault, Fault::kDoorOpen) << "a program";
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kRest; }));
  EXPECT_LT(mill.now().q_plan[0], 5 + 0.1) << "it stops in its first period";
}

// The jog in a hold is one, the hold itself is not.
TEST(CycleWiring, ADoorThatLetsTheOperatorJogDoesSoInAHold) {
  WiredMill mill({door(false)});
  mill.start("G21 G90\nG1 X50 F3000\nM2\n");
  ASSERT_TRUE(mill.until([&] { return mill.now().speed_mm_s > 10; }));
  mill.tell({Kind::kHold});
  ASSERT_TRUE(mill.until([&] { return mill.now().stands_in_hold; }));
  mill.tell({Kind::kJog, 20, 0, 1});
  mill.open_door();
  mill.run(50);
  EXPECT_EQ(mill.now().detour, DetourState::kJogs);
  EXPECT_EQ(mill.now().fault, Fault::kOk);
}

// At M0 the program stands, but a jog there and the way back do move.
TEST(CycleWiring, ADoorThatStopsJogsStopsThoseAtAProgramStop) {
  WiredMill mill({door(true)});
  mill.start(kStopsBetween);
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kPaused; }));
  mill.open_door();
  mill.run(50);
  EXPECT_EQ(mill.now().fault, Fault::kOk) << "it stands";
  EXPECT_FALSE(mill.on(MachineSignal::kMoving));
  const JointVec stood = mill.now().q_plan;
  mill.tell({Kind::kJog, 20, 0, 1});
  mill.run(500);
  EXPECT_EQ(mill.now().fault, Fault::kDoorOpen);
  EXPECT_LT((mill.now().q_plan - stood).cwiseAbs().maxCoeff(), 0.1);
}

TEST(CycleWiring, TheWayBackToAProgramStopIsWatched) {
  WiredMill mill({door(true)});
  mill.start(kStopsBetween);
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kPaused; }));
  mill.run(5);  // it has stood for a moment
  mill.tell({Kind::kJog, 60, 0, 1});
  EXPECT_TRUE(mill.on(MachineSignal::kMoving));
  mill.run(5000);
  ASSERT_NEAR(mill.now().q_plan[1], 60, 1e-6) << "jogged away with the door closed";
  EXPECT_FALSE(mill.on(MachineSignal::kMoving));
  mill.tell({Kind::kResume});
  mill.run(200);
  EXPECT_TRUE(mill.on(MachineSignal::kMoving)) << "it goes back";
  const double opened_mm = mill.now().q_plan[1];
  ASSERT_GT(opened_mm, 30);
  mill.open_door();
  mill.run(600);
  EXPECT_EQ(mill.now().motion, MotionState::kRest);
  EXPECT_EQ(mill.now().fault, Fault::kDoorOpen);
  EXPECT_GT(mill.now().q_plan[1], opened_mm - 10) << "it stops on the way";
}

TEST(CycleWiring, ADoorThatStopsJogsStopsThem) {
  WiredMill mill({door(true)});
  mill.open_door();
  mill.run(50);
  EXPECT_EQ(mill.now().fault, Fault::kOk) << "nothing moves";
  mill.tell({Kind::kJog, 5, 0, 0});
  EXPECT_EQ(mill.now().fault, Fault::kDoorOpen);
  ASSERT_TRUE(mill.until([&] { return mill.now().motion == MotionState::kRest; }));
  EXPECT_LT(mill.now().q_plan[0], 0.1);
}

}  // namespace
}  // namespace trn
