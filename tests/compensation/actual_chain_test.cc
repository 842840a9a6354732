#include "compensation/actual_chain.h"

#include <gtest/gtest.h>

#include <random>

#include "compensation/rtcp.h"
#include "core/config.h"
#include "core/ports.h"
#include "tests/compensation/true_machine.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

TEST(ActualChain, WithoutErrorsIsTheNominalMachine) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const char* name : {"cradle", "head", "head_table", "mill"}) {
    const LoadedMachine loaded = load_machine(name);
    const ActualChain chain = read_chain(loaded.machine);
    const int joints = loaded.kinematics->joint_count();
    for (int i = 0; i < 50; ++i) {
      JointVec q(joints);
      for (int k = 0; k < joints; ++k)
        q[k] = u(random) *
               (loaded.machine.joints[static_cast<std::size_t>(k)].kind == JointKind::kRotary ? 1 : 100);
      ActualChain::Frames frames;
      chain.evaluate(q, frames);
      Pose X_BS;
      ASSERT_EQ(loaded.kinematics->forward(q, X_BS), KinStatus::kOk);
      const Pose X_MB{frames.X_MB.A, frames.X_MB.p}, X_MS{frames.X_MS.A, frames.X_MS.p};
      const Pose actual = inverse(X_MB) * X_MS;
      EXPECT_LT((actual.p - X_BS.p).norm(), 1e-10) << name;
      EXPECT_LT((actual.R - X_BS.R).norm(), 1e-13) << name;
    }
  }
}

// The cradle's published errors as a product of matrices written down from the source.
TEST(ActualChain, WithErrorsIsTheProductOfTheSource) {
  const test::Pige e = test::measured_pige();
  ActualChain chain = read_chain(load_machine("cradle").machine);
  find_axis(chain, 3)->location = {{0, e.ey0a, e.ez0a}, {0, e.ty0a, e.tz0a}};
  find_axis(chain, 4)->location = {{e.ex0c, e.ey0c, 0}, {e.tx0c, e.ty0c, 0}};
  JointVec q(5);
  q << 30, -20, 50, 0.7, -2.1;
  ActualChain::Frames frames;
  chain.evaluate(q, frames);
  const Mat3 A_BM = frames.X_MB.A.inverse();
  const Vec3 tip = A_BM * (frames.X_MS.p - frames.X_MS.A * Vec3(0, 0, 80) - frames.X_MB.p);
  EXPECT_LT((tip - test::cradle(e, q, 80).tip).norm(), 1e-10);
  EXPECT_LT((A_BM * frames.X_MS.A.col(2) - test::cradle(e, q, 80).axis).norm(), 1e-13);
}

TEST(ActualChain, ExactTiltsAreRotations) {
  ActualChain chain = read_chain(load_machine("cradle").machine);
  find_axis(chain, 3)->location.tilt = {0, 0.03, -0.02};
  JointVec q = JointVec::Zero(5);
  ActualChain::Frames frames;
  chain.evaluate(q, frames);
  EXPECT_GT((frames.X_MB.A * frames.X_MB.A.transpose() - Mat3::Identity()).norm(), 1e-4) << "first order";
  chain.model = TiltModel::kExact;
  chain.evaluate(q, frames);
  EXPECT_LT((frames.X_MB.A * frames.X_MB.A.transpose() - Mat3::Identity()).norm(), 1e-14);
  EXPECT_GE(chain.tilt_bound(), std::acos(frames.X_MB.A(2, 2)) * (1 - 1e-12));
}

TEST(ActualChain, FindsAxesByJoint) {
  ActualChain chain = read_chain(load_machine("cradle").machine);
  EXPECT_EQ(find_axis(chain, 3)->kind, JointKind::kRotary);
  EXPECT_EQ(find_axis(chain, 7), nullptr);
  EXPECT_THROW(read_chain(load_machine("hexapod").machine), ConfigError);
}

TEST(Rtcp, TipAndSpindleAreEachOthersInverse) {
  const Mat3 R_BT = rot_z(0.4) * rot_x(-0.9);
  const Vec3 tip(10, -20, 30), tool(1, 2, 90);
  const Pose X_BS = spindle_from_tip(tip, R_BT, tool);
  EXPECT_LT((tip_from_spindle(X_BS, tool) - tip).norm(), 1e-13);
  // A tool along the spindle alone: P = tip + L u (docs/sources.md S2.2).
  EXPECT_LT((spindle_from_tip(tip, R_BT, {0, 0, 90}).p - (tip + 90 * R_BT.col(2))).norm(), 1e-13);
}

}  // namespace
}  // namespace trn
