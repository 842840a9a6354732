#include "app/lab/run_recorder.h"

#include <gtest/gtest.h>

#include "app/session/assembly.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

class Recorded : public ::testing::Test {
 protected:
  /// X moves at a steady rate, from rest.
  void drive(int periods, double mm_s) {
    for (int i = 0; i < periods; ++i) {
      x_ += mm_s * assembly_.machine.period_s;
      CycleReport report;
      report.q_plan = report.q_setpoint = JointVec::Zero(assembly_.kinematics->joint_count());
      report.q_plan[0] = report.q_setpoint[0] = x_;
      report.on_path = true;
      recorder_.write(report);
    }
  }
  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  RunRecorder recorder_{assembly_.machine, *assembly_.map};
  double x_ = 0;
};

TEST_F(Recorded, HoldsSpeedOfTheTipAndSharesOfTheLimits) {
  drive(1, 0);
  drive(20, 100);
  const RunBin& last = recorder_.bins().back();
  const JointLimit& limit = assembly_.machine.joints[0].limit;
  EXPECT_NEAR(last.speed_mm_s, 100, 1e-6);
  EXPECT_NEAR(last.velocity[0], 100 / limit.velocity, 1e-6);
  EXPECT_NEAR(last.jerk[0], 0, 1e-3);
  EXPECT_NEAR(recorder_.bins()[1].jerk[0], 100 / 1e-6 / limit.jerk, 1) << "the jump at the start";
  EXPECT_EQ(recorder_.bins()[1].worst_joint, 0);
  EXPECT_NEAR(last.t_s, 20 * assembly_.machine.period_s, 1e-12);
}

TEST_F(Recorded, MergesNeighboursButLosesNoPeak) {
  drive(9000, 10);
  drive(1, 5000);
  drive(9000, 10);
  EXPECT_LE(recorder_.bins().size(), 6000u);
  float peak = 0;
  double before = -1;
  for (const RunBin& bin : recorder_.bins()) {
    peak = std::max(peak, bin.velocity[0]);
    EXPECT_GT(bin.t_s, before);
    before = bin.t_s;
  }
  EXPECT_NEAR(peak, 5000 / assembly_.machine.joints[0].limit.velocity, 1e-3);
  EXPECT_GT(recorder_.bins().back().t_s, 17.9 * assembly_.machine.period_s * 1000);
}

}  // namespace
}  // namespace trn
