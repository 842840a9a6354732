#include "sim/simulated_drives.h"

#include <gtest/gtest.h>

#include "app/session/make_drives.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/units.h"
#include "hal/loopback.h"

namespace trn {
namespace {

constexpr char kMachine[] = R"(
[machine]
name = "test"
period_s = 0.001
[[joint]]
name = "X"
type = "linear"
min_mm = -100
max_mm = 100
velocity_mm_s = 100
acceleration_mm_s2 = 1000
jerk_mm_s3 = 20000
[[joint]]
name = "C"
type = "rotary"
min_deg = -180
max_deg = 180
velocity_deg_s = 90
acceleration_deg_s2 = 900
jerk_deg_s3 = 9000
)";

struct Bench {
  explicit Bench(const std::string& drives_section)
      : machine(read_machine(
            parse_config(kMachine + ("[drives]\ntype = \"simulated\"\n" + drives_section), "test.toml"))),
        drives(read_simulated_drives(machine, machine.root.table("drives"))) {
    setpoints.q = setpoints.qd = JointVec::Zero(2);
  }
  void run(int periods) {
    for (int k = 0; k < periods; ++k) drives.exchange(setpoints, feedback);
  }
  void enable() {
    drives.bring_up();
    run(1);
    setpoints.q = feedback.q;
    run(60);
    ASSERT_EQ(feedback.state, DriveState::kEnabled);
  }
  void move(int joint, double speed_per_s, int periods) {
    for (int k = 0; k < periods; ++k) {
      setpoints.q[joint] += speed_per_s * machine.period_s;
      drives.exchange(setpoints, feedback);
    }
  }
  Machine machine;
  SimulatedDrives drives;
  Setpoints setpoints;
  Feedback feedback;
};

TEST(SimulatedDrives, StartUpTakesItsTimeAndIgnoresSetpointsUntilThen) {
  Bench bench("start_up_s = 0.020");
  bench.run(5);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  bench.drives.bring_up();
  bench.setpoints.q[0] = 1;
  bench.run(20);
  EXPECT_EQ(bench.feedback.state, DriveState::kStarting);
  EXPECT_EQ(bench.feedback.q[0], 0);
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
  EXPECT_EQ(bench.feedback.homed_mask, 3u);
}

TEST(SimulatedDrives, FollowTheirSetpoints) {
  Bench bench("");
  bench.enable();
  bench.move(0, 50, 500);
  EXPECT_NEAR(bench.feedback.q[0], 25, 1e-3);
  bench.run(300);
  EXPECT_NEAR(bench.feedback.q[0], 25, 1e-9);
  EXPECT_EQ(bench.feedback.fault, Fault::kOk);
}

TEST(SimulatedDrives, JumpBeyondTheFollowingErrorFaults) {
  Bench bench("following_error_mm = 0.5");
  bench.enable();
  bench.setpoints.q[0] = 0.49;
  bench.run(200);
  EXPECT_EQ(bench.feedback.fault, Fault::kOk);
  bench.setpoints.q[0] += 0.8;
  bench.run(1);
  EXPECT_EQ(bench.feedback.fault, Fault::kFollowingError);
  EXPECT_EQ(bench.feedback.fault_joint, 0);
  EXPECT_EQ(bench.feedback.state, DriveState::kFault);
}

TEST(SimulatedDrives, StuckJointShowsAsFollowingError) {
  Bench bench("");
  bench.enable();
  bench.drives.joint(1).set_stuck(true);
  bench.move(1, rad_from_deg(30), 66);
  EXPECT_EQ(bench.feedback.fault, Fault::kOk) << "1.98 deg is inside the 2 deg of the config";
  bench.move(1, rad_from_deg(30), 2);
  EXPECT_EQ(bench.feedback.fault, Fault::kFollowingError);
  EXPECT_EQ(bench.feedback.fault_joint, 1);
  EXPECT_EQ(bench.feedback.q[1], 0);
}

TEST(SimulatedDrives, QuickStopBrakesByItsRampThenDisables) {
  Bench bench("quick_stop_factor = 2.0");
  bench.enable();
  bench.move(0, 100, 300);
  const double from = bench.feedback.q[0];
  bench.drives.quick_stop();
  bench.run(40);
  EXPECT_EQ(bench.feedback.state, DriveState::kQuickStop);
  bench.run(60);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  EXPECT_NEAR(bench.feedback.q[0] - from, 100.0 * 100.0 / (2 * 2000), 0.15) << "v^2 / 2a";
  const double rest = bench.feedback.q[0];
  bench.move(0, 100, 10);
  EXPECT_EQ(bench.feedback.q[0], rest) << "disabled drives hold";
}

TEST(SimulatedDrives, AQuickStopTakesABringUpBack) {
  Bench bench("");
  bench.drives.bring_up();
  bench.drives.quick_stop();
  for (int i = 0; i < 500; ++i) {
    bench.run(1);
    ASSERT_EQ(bench.feedback.state, DriveState::kOff) << i;
  }
  bench.enable();
  EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
}

// Both are asked for between two periods: no moment of power at the end.
TEST(SimulatedDrives, OffMeansOffBehindABringUp) {
  Bench bench("");
  bench.drives.bring_up();
  bench.drives.shut_down();
  for (int i = 0; i < 500; ++i) {
    bench.run(1);
    ASSERT_EQ(bench.feedback.state, DriveState::kOff) << i;
  }
}

TEST(SimulatedDrives, HomingFindsTheTruePositionFromEitherSideOfTheSwitch) {
  for (const char* start : {"start_mm = 31.0", "start_mm = -7.5"}) {
    Bench bench(std::string("homed = false\n[[drives.joint]]\nname = \"X\"\nhome_mm = 3.0\n") + start);
    bench.enable();
    EXPECT_EQ(bench.feedback.homed_mask, 0u);
    EXPECT_EQ(bench.feedback.q[0], 0) << "an incremental encoder reads 0 at power-on";
    bench.drives.request_home(1u);
    bench.run(1);
    EXPECT_EQ(bench.feedback.state, DriveState::kHoming);
    int periods = 0;
    while (bench.feedback.homed_mask == 0 && periods++ < 10000) bench.run(1);
    EXPECT_EQ(bench.feedback.homed_mask, 1u);
    EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
    EXPECT_NEAR(bench.feedback.q[0], 4.0, 0.02) << "switch at 3, index 1 above, then the braking distance";
    bench.setpoints.q = bench.feedback.q;
    bench.move(0, 10, 100);
    EXPECT_NEAR(bench.feedback.q[0], 5.0, 0.03);
    EXPECT_EQ(bench.feedback.fault, Fault::kOk);
  }
}

TEST(SimulatedDrives, HomingSpeedsAndAccelerationsStayInsideTheJointsLimits) {
  Bench bench("homed = false\n[[drives.joint]]\nname = \"X\"\nstart_mm = 20\nhoming_speed_mm_s = 400");
  bench.enable();
  bench.drives.request_home(1u);
  double last = 0, fastest = 0;
  while (bench.feedback.homed_mask == 0) {
    last = bench.feedback.q[0];
    bench.run(1);
    if (bench.feedback.homed_mask == 0)
      fastest = std::max(fastest, std::abs(bench.feedback.q[0] - last) * 1000);
  }
  EXPECT_LT(fastest, 105) << "100 mm/s and the overshoot of the loop";
  EXPECT_GT(fastest, 90);
}

TEST(SimulatedDrives, DeadHomeSwitchEndsHomingAtTheLimitSwitch) {
  Bench bench("homed = false");
  bench.enable();
  bench.drives.joint(0).set_home_switch_dead(true);
  bench.drives.request_home(1u);
  bench.run(8000);
  EXPECT_EQ(bench.feedback.fault, Fault::kHomingFailed);
  EXPECT_EQ(bench.feedback.homed_mask, 0u);
  EXPECT_EQ(bench.feedback.limit_switch_mask, 1u);
}

TEST(SimulatedDrives, HomingTimesOut) {
  Bench bench("homed = false\nhoming_timeout_s = 0.5\n[[drives.joint]]\nname = \"X\"\nstart_mm = 90");
  bench.enable();
  bench.drives.request_home(1u);
  bench.run(502);
  EXPECT_EQ(bench.feedback.fault, Fault::kHomingFailed);
}

TEST(SimulatedDrives, LimitSwitchFaultsOutwardsAndLetsJogInwards) {
  Bench bench("limit_switch_margin_mm = 1\n[[drives.joint]]\nname = \"X\"\nstart_mm = 100");
  bench.enable();
  bench.move(0, 20, 70);
  EXPECT_EQ(bench.feedback.fault, Fault::kLimitSwitch);
  EXPECT_EQ(bench.feedback.limit_switch_mask, 1u);
  bench.run(200);
  bench.drives.reset_faults();
  bench.run(1);
  bench.enable();
  EXPECT_EQ(bench.feedback.limit_switch_mask, 1u);
  bench.move(0, -20, 100);
  EXPECT_EQ(bench.feedback.fault, Fault::kOk);
  EXPECT_EQ(bench.feedback.limit_switch_mask, 0u);
}

TEST(SimulatedDrives, FaultStaysUntilReset) {
  Bench bench("");
  bench.enable();
  bench.drives.joint(1).fail(Fault::kDriveFault);
  bench.run(100);
  EXPECT_EQ(bench.feedback.fault, Fault::kDriveFault);
  bench.drives.bring_up();
  bench.run(100);
  EXPECT_EQ(bench.feedback.state, DriveState::kFault) << "a fault must be reset first";
  bench.drives.quick_stop();
  bench.run(50);
  bench.drives.reset_faults();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  bench.enable();
}

TEST(SimulatedDrives, BringUpDuringAQuickStopWaitsForItsEnd) {
  Bench bench("");
  bench.enable();
  bench.move(0, 100, 300);
  bench.drives.quick_stop();
  bench.run(5);
  bench.drives.reset_faults();
  bench.drives.bring_up();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kQuickStop);
  for (int k = 0; k < 200; ++k) {
    bench.setpoints.q = bench.feedback.q;
    bench.run(1);
  }
  EXPECT_EQ(bench.feedback.state, DriveState::kEnabled);
}

TEST(SimulatedDrives, LostDriveFreezesItsReport) {
  Bench bench("");
  bench.enable();
  bench.move(0, 10, 50);
  bench.drives.joint(0).set_lost(true);
  const double last = bench.feedback.q[0];
  bench.move(0, 10, 50);
  EXPECT_EQ(bench.feedback.state, DriveState::kLost);
  EXPECT_EQ(bench.feedback.fault, Fault::kDriveLost);
  EXPECT_EQ(bench.feedback.q[0], last);
}

TEST(SimulatedDrives, ScriptActsInItsPeriod) {
  Bench bench("[[drives.script]]\nat_s = 0.3\njoint = \"C\"\nevent = \"fault\"");
  bench.enable();
  bench.run(239);  // periods 0 to 299 are done
  EXPECT_EQ(bench.feedback.fault, Fault::kOk);
  bench.run(1);
  EXPECT_EQ(bench.feedback.fault, Fault::kDriveFault);
  EXPECT_EQ(bench.feedback.fault_joint, 1);
}

TEST(SimulatedDrives, AreDeterministic) {
  const auto play = [] {
    Bench bench("homed = false");
    bench.enable();
    bench.drives.request_home(3u);
    bench.run(700);
    bench.setpoints.q = bench.feedback.q;
    bench.move(0, 33.3, 321);
    return bench.feedback.q;
  };
  EXPECT_EQ(play(), play());
}

std::string refusal(const std::string& section) {
  const Machine machine = read_machine(parse_config(kMachine + section, "test.toml"));
  try {
    make_drives(machine);
    machine.root.table("drives").finish();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(MakeDrives, RefusesWhatItDoesNotKnow) {
  EXPECT_NE(refusal("[drives]\ntype = \"simulatd\"").find("simulated"), std::string::npos);
  EXPECT_NE(refusal("[drives]\ntype = \"simulated\"\ndampng = 0.7").find("did you mean 'damping'"),
            std::string::npos);
  EXPECT_NE(refusal("[drives]\ntype = \"loopback\"\ndamping = 0.7").find("unknown key"), std::string::npos);
  EXPECT_NE(
      refusal("[drives]\ntype = \"simulated\"\n[[drives.joint]]\nname = \"C\"\nhome_mm = 1").find("home_mm"),
      std::string::npos);
  EXPECT_NE(refusal("[drives]\ntype = \"simulated\"\n[[drives.joint]]\nname = \"Q\"").find("X, C"),
            std::string::npos);
  EXPECT_NE(refusal("[drives]\ntype = \"simulated\"\n[[drives.joint]]\nname = \"X\"\nhome_mm = 101")
                .find("out of range"),
            std::string::npos);
  EXPECT_EQ(refusal("[drives]\ntype = \"loopback\""), "");
  EXPECT_EQ(refusal("[drives]\ntype = \"simulated\"\nfollowing_error_deg = 1"), "");
}

TEST(MakeDrives, LoopbackStandsAtTheSetpointOfThePeriod) {
  const Machine machine =
      read_machine(parse_config(std::string(kMachine) + "[drives]\ntype = \"loopback\"", "t"));
  const std::unique_ptr<Drives> drives = make_drives(machine);
  Setpoints setpoints{JointVec::Constant(2, 1.25), JointVec::Zero(2)};
  Feedback feedback;
  drives->exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kOff);
  EXPECT_EQ(feedback.q[0], 0);
  drives->bring_up();
  drives->exchange(setpoints, feedback);
  EXPECT_EQ(feedback.state, DriveState::kEnabled);
  EXPECT_EQ(feedback.q, setpoints.q);
  EXPECT_EQ(feedback.homed_mask, 3u);
}

TEST(SimulatedDrives, AQuickStopOfDrivesThatAreOffLeavesThemOff) {
  Bench bench("");
  bench.run(1);
  bench.drives.quick_stop();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kOff);
  bench.drives.bring_up();
  bench.run(1);
  EXPECT_EQ(bench.feedback.state, DriveState::kStarting);
}

}  // namespace
}  // namespace trn
