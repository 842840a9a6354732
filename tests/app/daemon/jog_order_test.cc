#include "app/daemon/jog_order.h"

#include <gtest/gtest.h>

#include "app/session/assembly.h"
#include "core/units.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

Assembly shipped(const std::string& name) { return assemble(source_dir() + "/configs/" + name + ".toml"); }

// Against the joint map: a jog of the word ends where the word's own move from zero ends.
TEST(JogOrder, AWordMovesAsAProgramMeansIt) {
  for (const char* name : {"mill", "cradle", "head", "head_table", "micro_stage"}) {
    const Assembly assembly = shipped(name);
    const JointVec zero = JointVec::Zero(assembly.kinematics->joint_count());
    int words = 0;
    for (int word = kX; word <= kC; ++word) {
      if ((assembly.kinematics->word_mask() >> word & 1U) == 0) continue;
      ++words;
      const double way = word >= kA ? rad_from_deg(1) : 1;
      Words there = Words::Zero();
      there[word] = way;
      JointVec expected;
      ASSERT_EQ(assembly.kinematics->joints_from_words(there, expected), KinStatus::kOk);
      const JogOrder order = plan_jog({std::string(1, kWordLetters[word]), 0, way}, assembly.kinematics.get(),
                                      assembly.plan_joints, zero);
      ASSERT_EQ(order.refusal, "") << name << kWordLetters[word];
      JointVec jogged = zero;
      jogged[order.joint] = order.way;
      EXPECT_LT((jogged - expected).norm(), 1e-12) << name << kWordLetters[word];
    }
    EXPECT_EQ(words, assembly.kinematics->joint_count());
  }
}

TEST(JogOrder, AWordOfSeveralJointsIsRefused) {
  const Assembly assembly = shipped("hexapod");
  JointVec q;
  Words there = Words::Zero();
  there[kZ] = 100;
  static_cast<void>(assembly.kinematics->joints_from_words(there, q));
  const JogOrder order = plan_jog({"X", 0, 1}, assembly.kinematics.get(), assembly.plan_joints, q);
  EXPECT_NE(order.refusal.find("--along machine"), std::string::npos) << order.refusal;
  const std::string leg = assembly.machine.joints[2].name;
  EXPECT_EQ(plan_jog({leg, 0, 1e-3}, assembly.kinematics.get(), assembly.plan_joints, q).joint, 2);
}

TEST(JogOrder, LimitsAreToldInTheWordsOwnSense) {
  const Assembly assembly = shipped("mill");
  JointVec q = JointVec::Zero(3);
  q[1] = 195;  // Y-195
  const auto jog = [&](double way, double speed = 0) {
    return plan_jog({"Y", 0, way, speed}, assembly.kinematics.get(), assembly.plan_joints, q);
  };
  EXPECT_EQ(jog(-4).remark, "");
  EXPECT_EQ(jog(-50).remark, "Y stops at its limit, -200.0000 mm: 5.0000 mm instead of 50.0000");
  EXPECT_EQ(jog(50, 9999).remark, "Y goes at its limit of 400 mm/s instead of 9999");
  EXPECT_EQ(jog(-50, 9999).remark.find("Y stops"), 0U);
  EXPECT_NE(jog(-50, 9999).remark.find("\nY goes at"), std::string::npos);
  q[1] = 200;
  EXPECT_NE(jog(-1).refusal.find("-200.0000 mm"), std::string::npos) << jog(-1).refusal;
  EXPECT_EQ(jog(1).refusal, "");
  q[1] = 210;  // outside, as after a crash: the way back is free
  EXPECT_NE(jog(-1).refusal, "");
  EXPECT_EQ(jog(20).refusal, "");
}

TEST(JogOrder, AHeldJogGoesOnToTheLimitInTheWordsSense) {
  const Assembly assembly = shipped("mill");
  const JointVec q = JointVec::Zero(3);
  JogWish wish{"Y", 0, 1};
  wish.held = true;
  wish.speed_share = 0.25;
  JogOrder order = plan_jog(wish, assembly.kinematics.get(), assembly.plan_joints, q);
  EXPECT_EQ(order.refusal + order.remark, "") << "it is meant to go as far as it is held";
  EXPECT_EQ(order.joint, 1);
  EXPECT_LT(order.way, -assembly.plan_joints[1].limit.max);
  EXPECT_DOUBLE_EQ(order.speed, 0.25 * assembly.plan_joints[1].limit.velocity);
  wish.way = 0;  // let go
  order = plan_jog(wish, assembly.kinematics.get(), assembly.plan_joints, q);
  EXPECT_EQ(order.refusal + order.remark, "");
  EXPECT_EQ(order.way, 0);
}

}  // namespace
}  // namespace trn
