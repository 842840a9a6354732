#include "kernel/joint_ramp.h"

#include <gtest/gtest.h>

#include "app/check/limit_judge.h"
#include "tests/kernel/planned_motion.h"

namespace trn {
namespace {

constexpr double kT = 1e-3;

Joints two_joints() {
  Joints joints(2);
  joints[0].limit = {-100, 100, 200, 2000, 40000};
  joints[1].kind = JointKind::kRotary;
  joints[1].limit = {-1, 1, 2, 10, 200};
  return joints;
}

JointVec joints_at(double x, double a) {
  JointVec q(2);
  q << x, a;
  return q;
}

TEST(JointRamp, AllJointsArriveTogetherAndTheSlowestDecides) {
  const Joints joints = two_joints();
  JointRamp ramp(joints, kT);
  JointJudge judge(joints, kT);
  const JointVec from = joints_at(1, 0), way = joints_at(0.5, 0.4);
  ramp.begin_way(from, way, 1);
  judge(from);
  JointVec q = from;
  while (!ramp.ended()) {
    q = ramp.step(1);
    judge(q);
    ASSERT_NEAR((q[0] - 1) / 0.5, q[1] / 0.4, 1e-12);
  }
  EXPECT_LT((q - from - way).norm(), 1e-12);
  EXPECT_LE(judge.worst(), 1 + 1e-6);
  EXPECT_GT(judge.worst(), 0.75) << "of a joint that decides, a share of 0.8 to 0.9 is used";
}

TEST(JointRamp, AStopWithinTheWayKeepsTheLimits) {
  const Joints joints = two_joints();
  JointRamp ramp(joints, kT);
  JointJudge judge(joints, kT);
  ramp.begin_way(joints_at(0, 0), joints_at(90, 0), 1);
  judge(joints_at(0, 0));
  for (int i = 0; i < 150; ++i) judge(ramp.step(1));
  int periods = 0;
  for (; ramp.rate() > 0 && periods < 3000; ++periods) judge(ramp.step(0));
  EXPECT_EQ(ramp.rate(), 0);
  EXPECT_FALSE(ramp.ended());
  EXPECT_LT(periods, 1500);
  const JointVec stands = ramp.step(0);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(ramp.step(0), stands);
  EXPECT_LE(judge.worst(), 1 + 1e-6);
}

}  // namespace
}  // namespace trn
