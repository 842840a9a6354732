#include "hal/loopback.h"

#include <gtest/gtest.h>

#include "core/fault.h"

namespace trn {
namespace {

TEST(LoopbackDrives, QuickStopHoldsUntilBroughtUpAgain) {
  LoopbackDrives drives(JointVec::Constant(3, 5.0));
  Setpoints setpoints{JointVec::Constant(3, 7.0), JointVec::Zero(3)};
  Feedback feedback;
  drives.bring_up();
  drives.exchange(setpoints, feedback);
  drives.quick_stop();
  setpoints.q.setConstant(9.0);
  drives.exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kOff);
  EXPECT_EQ(feedback.q[2], 7.0);
  drives.bring_up();
  drives.exchange(setpoints, feedback);
  EXPECT_EQ(feedback.q[2], 9.0);
  EXPECT_EQ(feedback.fault, Fault::kOk);
  EXPECT_EQ(feedback.homed_mask, 7u);
}

}  // namespace
}  // namespace trn
