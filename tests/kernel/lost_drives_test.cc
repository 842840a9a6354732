#include <gtest/gtest.h>

#include <cmath>

#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// Drives that leave their state in the middle of a motion without a fault of their own.
namespace trn {
namespace {

class LeavingDrives final : public Drives {
 public:
  explicit LeavingDrives(const JointVec& q) : q_(q) {}
  void bring_up() override { state = DriveState::kEnabled; }
  void shut_down() noexcept override {}
  void reset_faults() override {}
  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override {
    told = setpoints;
    if (state == DriveState::kEnabled) q_ = setpoints.q;
    feedback = Feedback{};
    feedback.q = q_;
    feedback.state = state;
    feedback.homed_mask = ~0u;
    feedback.fault = fault;
  }
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override {}

  void slide(double way) { q_[0] += way; }
  const JointVec& place() const { return q_; }

  DriveState state = DriveState::kOff;
  Fault fault = Fault::kOk;
  Setpoints told;

 private:
  JointVec q_;
};

class LostDrives : public testing::Test {
 protected:
  LostDrives() {
    cycle.tick();
    drives.bring_up();
    for (int i = 0; i < 3; ++i) cycle.tick();
    for (const MotionBlock& block : motion.blocks()) queue.push(block);
    cycle.post({RtCommand::Kind::kStart});
    for (int i = 0; i < 200; ++i) cycle.tick();
  }
  const CycleReport& report() const { return cycle.last_report(); }
  /// Left and right in turn, each time as far into the motion as the first time.
  void jog_away(int count) {
    cycle.post({RtCommand::Kind::kJog, count % 2 ? -90.0 : 90.0, 50, 0});
    for (int i = 0; i < 300; ++i) cycle.tick();
    ASSERT_EQ(report().motion, MotionState::kJogging);
  }

  const PlannedMotion motion{source_dir() + "/configs/mill.toml", "G21 G91 G1 X50 F3000\nM2\n"};
  MotionQueue queue{motion.blocks().size() + 1};
  LeavingDrives drives{motion.q(0)};
  Cycle cycle{cycle_config(motion.assembly(), ProgramStops::kPass),
              {*motion.assembly().map, queue, drives, *motion.assembly().rate_plans}};
};

TEST_F(LostDrives, ThePlanRunsOutWhileTheDrivesAreToldWhereTheyStand) {
  ASSERT_EQ(report().motion, MotionState::kMoving);
  const double speed = 50 * motion.assembly().machine.period_s;  // F3000
  drives.state = DriveState::kOff;
  cycle.tick();  // its feedback comes with this period, and acts in the next
  double before = report().q_setpoint[0], way = speed;
  const double stands = before;
  int moving = 0;
  for (; moving < 3000; ++moving) {
    cycle.tick();
    if (report().motion == MotionState::kRest) break;
    EXPECT_NEAR(drives.told.q[0], stands, 2 * speed) << moving;
    EXPECT_TRUE(drives.told.qd.isZero(0)) << moving;
    EXPECT_NEAR(report().q_setpoint[0] - before, way, 0.1 * speed)
        << moving << ": a step in what is recorded";
    way = report().q_setpoint[0] - before;
    before = report().q_setpoint[0];
  }
  EXPECT_GT(moving, 10);
  EXPECT_LT(before, 40) << "it stops where it can, not at the end of the program";
  EXPECT_EQ(report().fault, Fault::kOk);
}

// The drives brake by themselves; what is recorded goes on along the path and stops there.
TEST_F(LostDrives, ADrivesFaultLetsThePlanRunOut) {
  drives.state = DriveState::kFault;
  drives.fault = Fault::kFollowingError;
  cycle.tick();
  int moving = 0;
  while (moving < 3000 && report().motion != MotionState::kRest) cycle.tick(), ++moving;
  EXPECT_EQ(report().fault, Fault::kFollowingError);
  EXPECT_GT(moving, 10);
  EXPECT_LT(report().q_setpoint[0], 40);
}

TEST_F(LostDrives, DrivesThatComeBackFindNoMotion) {
  drives.state = DriveState::kOff;
  for (int i = 0; i < 5; ++i) cycle.tick();
  drives.state = DriveState::kEnabled;
  for (int i = 0; i < 2; ++i) cycle.tick();
  EXPECT_EQ(report().motion, MotionState::kRest);
  const double stands = report().q_setpoint[0];
  for (int i = 0; i < 50; ++i) cycle.tick();
  EXPECT_EQ(report().q_setpoint[0], stands);
}

// In whatever period of the plan's running out the drives are back, and also in that of its end: the first
// setpoint that they obey and all after it are where they stood. They slide while they brake.
TEST_F(LostDrives, DrivesThatComeBackStayWhereTheyStand) {
  const double slide = 0.0123;
  int running_out = 0;
  for (int away = 1; away < 400; ++away) {
    SCOPED_TRACE(away);
    drives.state = DriveState::kOff;
    for (int i = 0; i < away; ++i) {
      drives.slide(slide / away);
      cycle.tick();
    }
    running_out += report().motion != MotionState::kRest;
    drives.state = DriveState::kEnabled;
    const JointVec stands = drives.place();
    for (int i = 0; i < 20; ++i) {
      cycle.tick();
      ASSERT_NEAR((drives.told.q - stands).cwiseAbs().maxCoeff(), 0, 1e-12) << i;
    }
    ASSERT_EQ(report().motion, MotionState::kRest);
    jog_away(away);
  }
  EXPECT_GT(running_out, 50);
}

// A spindle that is an axis too is told its turns on top of the plan: those, too, stay as they were.
TEST(LostSpindle, ThatIsAnAxisStaysWhereItStands) {
  for (const int away : {1, 2, 7, 60, 400}) {
    SCOPED_TRACE(away);
    const PlannedMotion motion(source_dir() + "/configs/spindle_axis.toml",
                               "G21 G91 G94\nS600 M3\nG1 X90 F3000\nM2\n");
    const Assembly& assembly = motion.assembly();
    MotionQueue queue{motion.blocks().size() + 1};
    LeavingDrives drives{motion.q(0)};
    Cycle cycle{cycle_config(assembly, ProgramStops::kPass),
                {*assembly.map, queue, drives, *assembly.rate_plans, nullptr, assembly.io.get(),
                 assembly.spindle_axis}};
    cycle.tick();
    drives.bring_up();
    for (int i = 0; i < 3; ++i) cycle.tick();
    for (const MotionBlock& block : motion.blocks()) queue.push(block);
    cycle.post({RtCommand::Kind::kStart});
    for (int i = 0; i < 3000 && cycle.last_report().q_setpoint[0] < 10; ++i) cycle.tick();
    ASSERT_EQ(cycle.last_report().motion, MotionState::kMoving);
    ASSERT_GT(std::abs(drives.told.q[3]), 6.0) << "it has turned";
    drives.state = DriveState::kFault;
    drives.fault = Fault::kFollowingError;  // switches the spindle off
    for (int i = 0; i < away; ++i) cycle.tick();
    drives.state = DriveState::kEnabled;
    drives.fault = Fault::kOk;
    const JointVec stands = drives.place();
    for (int i = 0; i < 20; ++i) {
      cycle.tick();
      ASSERT_NEAR((drives.told.q - stands).cwiseAbs().maxCoeff(), 0, 1e-9) << i;
    }
    ASSERT_EQ(cycle.last_report().motion, MotionState::kRest);
  }
}

class StandingMachine : public testing::Test {
 protected:
  StandingMachine() {
    cycle.tick();
    drives.bring_up();
    for (int i = 0; i < 3; ++i) cycle.tick();
  }
  MotionState after(const RtCommand& command) {
    cycle.post(command);
    cycle.tick();
    return cycle.last_report().motion;
  }
  const PlannedMotion motion{source_dir() + "/configs/mill.toml", "G21 G91 G1 X50 F3000\nM2\n"};
  MotionQueue queue{400};
  LeavingDrives drives{motion.q(0)};
  Cycle cycle{cycle_config(motion.assembly(), ProgramStops::kPass),
              {*motion.assembly().map, queue, drives, *motion.assembly().rate_plans}};
};

TEST_F(StandingMachine, AHoldIsOfMotionOnThePathOnly) {
  EXPECT_EQ(after({RtCommand::Kind::kHold}), MotionState::kRest);
  EXPECT_EQ(after({RtCommand::Kind::kJog, 5, 0, 0}), MotionState::kJogging);
  EXPECT_EQ(after({RtCommand::Kind::kHold}), MotionState::kJogging);
}

TEST_F(StandingMachine, AJointThatIsNotThereDoesNotJog) {
  for (const int joint : {-1, 3, 99})
    EXPECT_EQ(after({RtCommand::Kind::kJog, 5, 0, joint}), MotionState::kRest) << joint;
  EXPECT_EQ(after({RtCommand::Kind::kJog, 5, 0, 2}), MotionState::kJogging);
}

TEST_F(StandingMachine, BlocksWithoutEndInOnePeriodAreADefectOfNoJoint) {
  MotionBlock block = motion.blocks().front();
  for (const MotionBlock& each : motion.blocks())
    if (each.segment_count > 0) block = each;
  block.segment_count = 1;
  block.segments[0] = {1e-9, 0, 0, 0, 0};
  for (int i = 0; i < 300; ++i) {
    block.ends_at_rest = i == 299;
    queue.push(block);
  }
  after({RtCommand::Kind::kStart});
  for (int i = 0; i < 3; ++i) cycle.tick();
  EXPECT_EQ(cycle.last_report().fault, Fault::kAssertion);
  EXPECT_EQ(cycle.last_report().fault_joint, -1);
}

}  // namespace
}  // namespace trn
