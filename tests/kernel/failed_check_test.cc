#include <gtest/gtest.h>

#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "hal/loopback.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// A check that stays on fails in the middle of a motion.
namespace trn {
namespace {

/// The machine's own map, until it is broken: then it fails a check, and gives a place a little off.
class BreakingMap final : public JointMap {
 public:
  explicit BreakingMap(const JointMap& map) : map_(map) {}
  int joint_count() const TRN_RT override { return map_.joint_count(); }
  KinStatus map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT override {
    TRN_CHECK(!broken);
    const KinStatus status = map_.map(y, context, q);
    if (broken) q[0] += 1e-4;
    return status;
  }
  bool broken = false;

 private:
  const JointMap& map_;
};

TEST(FailedCheck, NothingComputedBehindItIsSentAndTheMachineStops) {
  const PlannedMotion motion(source_dir() + "/configs/mill.toml", "G21 G91 G1 X50 F3000\nM2\n");
  BreakingMap map(*motion.assembly().map);
  MotionQueue queue(motion.blocks().size() + 1);
  LoopbackDrives drives(motion.q(0));
  Cycle cycle(cycle_config(motion.assembly(), ProgramStops::kPass),
              {map, queue, drives, *motion.assembly().rate_plans});
  cycle.tick();
  drives.bring_up();
  for (int i = 0; i < 3; ++i) cycle.tick();
  for (const MotionBlock& block : motion.blocks()) queue.push(block);
  cycle.post({RtCommand::Kind::kStart});
  for (int i = 0; i < 200; ++i) cycle.tick();
  const JointVec sent = cycle.last_report().q_setpoint;
  ASSERT_NE(sent, motion.q(0)) << "it moves";
  ASSERT_EQ(cycle.last_report().fault, Fault::kOk);

  map.broken = true;
  cycle.tick();
  const CycleReport& report = cycle.last_report();
  EXPECT_EQ(report.q_setpoint, sent);
  EXPECT_EQ(report.fault, Fault::kAssertion);
  EXPECT_STREQ(report.failed_check.condition, "!broken");
  EXPECT_STREQ(report.failed_check.file, "failed_check_test.cc");
  EXPECT_EQ(report.motion, MotionState::kRest);
  for (int i = 0; i < 5; ++i) cycle.tick();
  EXPECT_EQ(report.q_setpoint, sent);
  EXPECT_NE(report.drives, DriveState::kEnabled) << "the drives were told to stop";

  cycle.post({RtCommand::Kind::kResetFault});
  cycle.tick();
  EXPECT_EQ(report.fault, Fault::kOk);
  EXPECT_FALSE(report.failed_check);
}

}  // namespace
}  // namespace trn
