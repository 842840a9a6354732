#include "kernel/hold_detour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/fault.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/paths.h"

// Jogs in a hold and the way back, through the whole tick.
namespace trn {
namespace {

using Kind = RtCommand::Kind;

constexpr const char* kPath =
    "G21 G90 G64 P0.02\nM3 S3000\nM8\nG1 X30 F3000\nY20\nG2 X50 Y40 I20\nG1 Z-10\nX0 Y0\nM2\n";

class HeldMachine {
 public:
  explicit HeldMachine(const std::string& machine = "mill", const std::string& program = kPath)
      : assembly_(assemble(source_dir() + "/configs/" + machine + ".toml")),
        queue_(1 << 14),
        cycle_(make_cycle(assembly_, queue_, ProgramStops::kWait)),
        judge_(assembly_.machine.joints, assembly_.machine.period_s) {
    assembly_.drives->bring_up();
    for (int i = 0; i < 20000 && now().drives != DriveState::kEnabled; ++i) cycle_.tick();
    pipeline_.emplace(assembly_, parameters_, tools_, ProgramStart{"test", program, now().q_plan},
                      PipelineObservers{});
    for (int i = 0; i < 4; ++i) judge_(now().q_setpoint);  // it stands
    post({Kind::kStart});
  }
  void tick() {
    while (!ended_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (!pipeline_->next(block_))
        ended_ = true;
      else
        queue_.push(block_);
    }
    const DetourState was = now().detour;
    const JointVec q_was = now().q_plan;
    const long before = allocation_count();
    cycle_.tick();
    allocations_ += allocation_count() - before;
    judge_(now().q_setpoint);
    if (now().on_path && now().detour == DetourState::kNone) path_.push_back(now().q_plan);
    if (was == DetourState::kNone && now().detour != was) q_left_ = q_was;
    if (was != DetourState::kNone && now().detour == DetourState::kNone &&
        now().motion != MotionState::kRest) {
      ++returns_;
      wrong_returns_ += now().q_plan != q_left_;
    }
    CycleReport taken;
    while (cycle_.next_report(taken)) {
    }
  }
  /// False if that has not come after so many periods.
  bool until(const std::function<bool()>& wanted, int periods = 20000) {
    for (int i = 0; i < periods && !wanted(); ++i) tick();
    return wanted();
  }
  void run(int periods) {
    for (int i = 0; i < periods; ++i) tick();
  }
  void post(const RtCommand& command) { cycle_.post(command); }
  void tell(const RtCommand& command) {
    post(command);
    tick();
  }
  bool held_at(std::uint32_t line) {
    return until([&] { return now().line == line && now().speed_mm_s > 1; }) && hold();
  }
  bool hold() {
    post({Kind::kHold});
    return until([this] { return now().stands_in_hold; });
  }
  bool jogged(int joint, double way, double speed = 0) {
    tell({Kind::kJog, way, speed, joint});
    return until([this] { return now().detour == DetourState::kAway && now().stands_in_hold; });
  }
  bool ended() {
    return until([this] { return now().motion == MotionState::kRest; });
  }
  const CycleReport& now() const { return cycle_.last_report(); }
  const std::vector<JointVec>& path() const { return path_; }
  double worst(std::string& where) const { return judge_.worst(&where); }
  long allocations() const { return allocations_; }
  int returns() const { return returns_; }
  int wrong_returns() const { return wrong_returns_; }

 private:
  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_;
  MotionQueue queue_;
  Cycle cycle_;
  JointJudge judge_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool ended_ = false;
  long allocations_ = 0;
  JointVec q_left_;
  int returns_ = 0, wrong_returns_ = 0;
  std::vector<JointVec> path_;
};

double distance(const JointVec& q, const JointVec& a, const JointVec& b) {
  const JointVec way = b - a;
  const double t = way.squaredNorm() > 0 ? std::clamp((q - a).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0;
  return (q - a - t * way).norm();
}

/// How far the places of `path` are from the polyline `truth` at most, both in the order of the motion.
double strays(const std::vector<JointVec>& path, const std::vector<JointVec>& truth) {
  double worst = 0;
  for (const JointVec& q : path) {
    double nearest = 1e9;
    for (std::size_t i = 1; i < truth.size(); ++i)
      nearest = std::min(nearest, distance(q, truth[i - 1], truth[i]));
    worst = std::max(worst, nearest);
  }
  return worst;
}

TEST(HoldDetour, ResumeLeadsBackToTheBitAndThePathIsTheUndisturbedOne) {
  HeldMachine undisturbed, machine;
  undisturbed.tick();
  ASSERT_TRUE(undisturbed.ended());
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  machine.post({Kind::kJog, 15, 0, 2});
  machine.run(30);
  ASSERT_TRUE(machine.jogged(0, -40));
  ASSERT_TRUE(machine.jogged(1, 12.5));
  EXPECT_EQ(machine.now().motion, MotionState::kHeld) << "the hold goes on";
  EXPECT_NEAR(machine.now().q_plan[0], q_hold[0] - 40, 1e-9);
  EXPECT_FALSE(machine.now().on_path);
  machine.tell({Kind::kResume});
  EXPECT_EQ(machine.now().motion, MotionState::kMoving);
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().q_plan, undisturbed.now().q_plan);
  EXPECT_LT(strays(machine.path(), undisturbed.path()), 0.001) << "chords of the arc's periods";
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  EXPECT_EQ(machine.allocations(), 0);
}

TEST(HoldDetour, TheWayBackObeysHoldAndOverride) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(4));
  const JointVec q_hold = machine.now().q_plan;
  ASSERT_TRUE(machine.jogged(1, 150));
  machine.tell({Kind::kResume});
  machine.run(200);
  const double fast = machine.now().q_plan[1];
  machine.run(100);
  const double way = std::abs(machine.now().q_plan[1] - fast);
  machine.tell({Kind::kOverride, 0.5});
  machine.run(500);
  const double slow = machine.now().q_plan[1];
  machine.run(100);
  EXPECT_NEAR(std::abs(machine.now().q_plan[1] - slow), way / 2, 1e-6);
  machine.tell({Kind::kHold});
  ASSERT_TRUE(machine.until([&] { return machine.now().stands_in_hold; }));
  EXPECT_EQ(machine.now().motion, MotionState::kHeld);
  const JointVec stands = machine.now().q_plan;
  machine.run(300);
  EXPECT_EQ(machine.now().q_plan, stands);
  EXPECT_GT((stands - q_hold).norm(), 1);
  ASSERT_TRUE(machine.jogged(0, 5)) << "away again, from there";
  machine.tell({Kind::kOverride, 0});
  machine.tell({Kind::kResume});
  machine.run(500);
  EXPECT_NEAR(machine.now().q_plan[0], stands[0] + 5, 1e-9) << "an override of 0 holds the way back too";
  machine.tell({Kind::kOverride, 1});
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  std::string where;
  EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
}

TEST(HoldDetour, AStopOnTheWayBackGivesTheProgramUp) {
  for (const bool jogs : {false, true}) {
    HeldMachine machine;
    ASSERT_TRUE(machine.held_at(4));
    ASSERT_TRUE(machine.jogged(1, 60));
    machine.tell(jogs ? RtCommand{Kind::kJog, 60, 0, 1} : RtCommand{Kind::kResume});
    machine.run(150);
    const JointVec before = machine.now().q_plan;
    machine.tell({Kind::kStop});
    EXPECT_EQ(machine.now().motion, MotionState::kMoving) << "it slows down";
    ASSERT_TRUE(machine.ended());
    EXPECT_GT((machine.now().q_plan - before).norm(), 0.01);
    EXPECT_EQ(machine.now().spindle_rpm, 0);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  }
}

TEST(HoldDetour, AnEmergencyStopForgetsTheWayBack) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(4));
  ASSERT_TRUE(machine.jogged(1, 60));
  machine.tell({Kind::kEmergencyStop});
  EXPECT_EQ(machine.now().motion, MotionState::kRest);
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
}

// The spindle needs its time to 3000 rpm; the machine waits in front of the last straight.
TEST(HoldDetour, SpindleAndCoolantAreAsTheProgramHadThemBeforeTheLastStraight) {
  HeldMachine machine;
  ASSERT_TRUE(machine.held_at(6));
  const JointVec q_hold = machine.now().q_plan;
  ASSERT_EQ(machine.now().spindle_rpm, 3000);
  machine.post({Kind::kCoolant, 0, 0, 0});
  machine.tell({Kind::kSpindle, 0});
  EXPECT_EQ(machine.now().spindle_rpm, 0);
  EXPECT_EQ(machine.now().coolant, 0);
  ASSERT_TRUE(machine.jogged(2, 20));
  ASSERT_TRUE(machine.until([&] { return machine.now().spindle_ready; }));
  machine.tell({Kind::kResume});
  EXPECT_EQ(machine.now().spindle_rpm, 3000);
  EXPECT_EQ(machine.now().coolant, 2);
  int waited = 0;
  while (machine.now().q_plan[2] > q_hold[2] + 19.999) {
    machine.tick();
    ++waited;
    ASSERT_LT(waited, 20000);
  }
  EXPECT_TRUE(machine.now().spindle_ready);
  EXPECT_GT(waited, 20);
  ASSERT_TRUE(machine.until([&] { return machine.now().detour == DetourState::kNone; }));
  EXPECT_EQ(machine.now().q_plan, q_hold);
  ASSERT_TRUE(machine.ended());
  EXPECT_EQ(machine.now().fault, Fault::kOk);
}

TEST(HoldDetour, AtProgramStopsAndBetweenSingleBlocksToo) {
  HeldMachine stop("mill", "G21 G90\nG1 X10 F3000\nM0\nX20\nM2\n");
  ASSERT_TRUE(
      stop.until([&] { return stop.now().motion == MotionState::kPaused && stop.now().stands_in_hold; }));
  ASSERT_TRUE(stop.jogged(2, 30));
  EXPECT_EQ(stop.now().motion, MotionState::kPaused);
  stop.tell({Kind::kResume});
  ASSERT_TRUE(stop.until([&] { return stop.now().detour == DetourState::kNone; }));
  EXPECT_EQ(stop.now().q_plan[2], 0);
  EXPECT_LT(stop.now().q_plan[0], 10.001);
  ASSERT_TRUE(stop.ended());
  EXPECT_NEAR(stop.now().q_plan[0], 20, 1e-9);

  HeldMachine single;
  single.post({Kind::kSingleBlock, 1});
  for (int i = 0; i < 20 && single.now().q_plan[0] < 29; ++i) {
    single.tell({Kind::kResume});
    ASSERT_TRUE(single.until(
        [&] { return single.now().motion == MotionState::kPaused && single.now().stands_in_hold; }));
  }
  const JointVec q = single.now().q_plan;
  ASSERT_TRUE(single.jogged(0, 7));
  single.tell({Kind::kResume});
  ASSERT_TRUE(single.until([&] { return single.now().detour == DetourState::kNone; }));
  EXPECT_EQ(single.now().q_plan, q);
  EXPECT_EQ(single.now().motion, MotionState::kMoving) << "one resume is enough";
}

TEST(HoldDetour, NothingIsObeyedBeforeTheMachineStands) {
  HeldMachine machine;
  ASSERT_TRUE(machine.until([&] { return machine.now().line == 4 && machine.now().speed_mm_s > 10; }));
  machine.tell({Kind::kJog, 10, 0, 1});
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
  machine.post({Kind::kHold});
  machine.tell({Kind::kJog, 10, 0, 1});
  EXPECT_EQ(machine.now().detour, DetourState::kNone);
  EXPECT_FALSE(machine.now().stands_in_hold);
}

class HeldConfigs : public testing::TestWithParam<std::string> {};

// Whatever the operator does in a hold, no joint passes a limit, and the machine comes back.
TEST_P(HeldConfigs, NothingThatTheOperatorDoesBreaksALimit) {
  std::string program = "G21 G94 G64 P0.02\nG91\n";
  for (int i = 0; i < 30; ++i) program += i % 2 ? "G1 F2000 X-4 Y3\n" : "G1 F2000 X4 Y-3\n";
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    std::mt19937_64 rng(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    std::uniform_int_distribution<int> pick(0, 9), wait(1, 120);
    HeldMachine machine(GetParam(), program + "M2\n");
    ASSERT_TRUE(machine.until([&] { return machine.now().speed_mm_s > 5; }));
    ASSERT_TRUE(machine.hold());
    const JointVec q_hold = machine.now().q_plan;
    std::uniform_int_distribution<int> joint(0, static_cast<int>(q_hold.size()) - 1);
    for (int i = 0; i < 40; ++i) {
      const int what = pick(rng);
      if (what < 6) machine.post({Kind::kJog, 3 * any(rng), 0, joint(rng)});
      if (what == 6) machine.post({Kind::kOverride, std::abs(any(rng))});
      if (what == 7) machine.post({Kind::kResume});
      if (what >= 8) machine.post({Kind::kHold});
      machine.run(wait(rng));
    }
    machine.post({Kind::kOverride, 1});
    const auto back = [&] { return machine.now().detour == DetourState::kNone && machine.now().line > 0; };
    machine.post({Kind::kResume});
    ASSERT_TRUE(machine.until(back, 60000));
    ASSERT_TRUE(machine.until([&] { return machine.now().motion == MotionState::kRest; }, 60000));
    EXPECT_EQ(machine.now().fault, Fault::kOk);
    EXPECT_GT(machine.returns(), 0);
    EXPECT_EQ(machine.wrong_returns(), 0);
    std::string where;
    EXPECT_LE(machine.worst(where), 1 + 1e-6) << where;
  }
}

INSTANTIATE_TEST_SUITE_P(HoldDetour, HeldConfigs, testing::Values("mill", "cradle", "hexapod"));

}  // namespace
}  // namespace trn
