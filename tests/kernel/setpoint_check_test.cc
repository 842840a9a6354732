#include "kernel/setpoint_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace trn {
namespace {

constexpr double kT = 1e-3;

Joints two_joints() {
  Joints joints(2);
  joints[0].limit = {-100, 100, 200, 2000, 40000};
  joints[1].limit = {-1, 1, 2, 10, 200};
  return joints;
}

SetpointVerdict judged(double x0, double x1, double a0 = 0, double a1 = 0) {
  JointVec last(2), q(2);
  last << x0, a0;
  q << x1, a1;
  return check_setpoints(two_joints(), kT, last, q);
}

TEST(SetpointCheck, WhatIsWithinRangeAndSpeedPasses) {
  EXPECT_EQ(judged(0, 0).fault, Fault::kOk);
  EXPECT_EQ(judged(0, 0.2).fault, Fault::kOk) << "just the speed limit";
  EXPECT_EQ(judged(99.9, 100).fault, Fault::kOk) << "just the end of the range";
}

TEST(SetpointCheck, AStepAboveTheSpeedLimitIsAJumpAndTellsItsJoint) {
  const SetpointVerdict first = judged(0, 0.2001);
  EXPECT_EQ(first.fault, Fault::kSetpointJump);
  EXPECT_EQ(first.joint, 0);
  const SetpointVerdict second = judged(0, 0, 0.5, 0.4979);
  EXPECT_EQ(second.fault, Fault::kSetpointJump);
  EXPECT_EQ(second.joint, 1);
}

TEST(SetpointCheck, LeavingTheRangeIsRefusedOnBothSides) {
  EXPECT_EQ(judged(100, 100.1).fault, Fault::kJointLimit);
  EXPECT_EQ(judged(-100, -100.1).fault, Fault::kJointLimit);
  EXPECT_EQ(judged(0, 0, 1, 1.001).joint, 1);
}

TEST(SetpointCheck, AJointThatStandsOutsideMayStayAndComeBackButGoNoFarther) {
  EXPECT_EQ(judged(120, 120).fault, Fault::kOk);
  EXPECT_EQ(judged(120, 119.9).fault, Fault::kOk);
  EXPECT_EQ(judged(120, 120.1).fault, Fault::kJointLimit);
}

TEST(SetpointCheck, WhatIsNotANumberNeverPasses) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(judged(0, nan).fault, Fault::kSetpointJump);
  EXPECT_EQ(judged(0, inf).fault, Fault::kSetpointJump);
  EXPECT_EQ(judged(nan, 0).fault, Fault::kSetpointJump);
}

}  // namespace
}  // namespace trn
