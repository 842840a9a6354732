#include "sim/micromill/micro_mill_drives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/micromill/part_surface.h"

namespace trn {
namespace {

struct Bench {
  Bench() : drives({micro_mill_plant(0, 0.001), std::nullopt, 0.5}) {
    setpoints.q = setpoints.qd = JointVec::Zero(3);
  }
  void run(int periods) {
    for (int k = 0; k < periods; ++k) drives.exchange(setpoints, feedback);
  }
  /// Mean current of a joint over so many periods, A.
  double mean_current_A(int joint, int periods) {
    double sum = 0;
    for (int k = 0; k < periods; ++k) {
      run(1);
      sum += feedback.current_A[joint];
    }
    return sum / periods;
  }
  MicroMillDrives drives;
  Setpoints setpoints;
  Feedback feedback;
};

// Both loops are opened: no motor draws the table to where it was to be.
TEST(MicroMillDrives, AfterAFollowingErrorNoMotorPulls) {
  Bench bench;
  bench.drives.bring_up();
  bench.run(100);
  ASSERT_EQ(bench.feedback.state, DriveState::kEnabled);
  bench.setpoints.q[1] = 30;
  bench.run(1);
  ASSERT_EQ(bench.feedback.state, DriveState::kFault);
  bench.run(500);
  for (const int joint : {0, 1}) EXPECT_NEAR(bench.mean_current_A(joint, 200), 0, 0.01) << joint;
  EXPECT_LT(std::abs(bench.feedback.q[1]), 15);
  EXPECT_EQ(bench.feedback.fault, Fault::kFollowingError);
}

TEST(MicroMillDrives, AStopOrTheEndTakesABringUpBack) {
  Bench bench;
  bench.drives.bring_up();
  bench.drives.quick_stop();
  bench.run(10);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  bench.drives.bring_up();
  bench.drives.shut_down();
  bench.run(10);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
}

TEST(MicroMillDrives, AFaultHoldsUntilItIsResetAndPowerUntilItIsAsked) {
  Bench bench;
  bench.drives.bring_up();
  bench.run(10);
  bench.setpoints.q[0] = 30;
  bench.run(1);
  ASSERT_EQ(bench.feedback.state, DriveState::kFault);
  EXPECT_EQ(bench.feedback.fault_joint, 0);
  bench.drives.bring_up();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kFault) << "not without a reset";
  bench.drives.reset_faults();
  bench.run(300);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  EXPECT_EQ(bench.feedback.fault, Fault::kOk);
  EXPECT_EQ(bench.feedback.fault_joint, -1);
  bench.setpoints.q = bench.feedback.q;
  bench.drives.bring_up();
  bench.run(100);
  EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
  bench.drives.quick_stop();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  bench.drives.bring_up();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
  bench.drives.shut_down();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
}

std::string machine_text(const std::string& third) {
  std::string text = "[machine]\nname = \"m\"\nperiod_s = 0.001\n";
  for (const std::string& name : {std::string("X"), std::string("Y"), third})
    text += "[[joint]]\nname = \"" + name +
            "\"\ntype = \"linear\"\nmin_mm = -30\nmax_mm = 30\nvelocity_mm_s = 100\n"
            "acceleration_mm_s2 = 1000\njerk_mm_s3 = 20000\n";
  return text;
}

MicroMillDrives::Config read(const std::string& third, const std::string& keys) {
  const Machine machine = read_machine(parse_config(machine_text(third) + "[drives]\n" + keys, "m.toml"));
  return read_micro_mill_drives(machine, machine.root.table("drives"));
}

TEST(MicroMillDrives, AreReadFromTheirSection) {
  const MicroMillDrives::Config plain = read("Z", ""), made = read("Z", R"(
mass_error = 0.1
part = "square"
following_error_mm = 0.3
)");
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_NEAR(made.plant.axes[i].mass_kg / plain.plant.axes[i].mass_kg, 1.1, 1e-12);
  EXPECT_FALSE(plain.part);
  ASSERT_TRUE(made.part);
  EXPECT_EQ(made.part->shape, PartSurface::Shape::kSquare);
  EXPECT_EQ(read("Z", "part = \"round\"\n").part->shape, PartSurface::Shape::kRound);
  EXPECT_EQ(made.following_error_max_mm, 0.3);
  EXPECT_NE(read("Z", "seed = 5\n").plant.axes[0].mass_kg, plain.plant.axes[0].mass_kg);
  EXPECT_THROW(read("W", ""), ConfigError);
  EXPECT_THROW(read("Z", "part = \"oval\"\n"), ConfigError);
  EXPECT_THROW(read("Z", "mass_error = 0.3\n"), ConfigError);
}

}  // namespace
}  // namespace trn
