#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/simulated_drives.h"
#include "sim/simulated_joint.h"

// The keys of [drives] for simulated drives.
namespace trn {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180;
constexpr char kMachine[] = R"(
[machine]
name = "test"
period_s = 0.001
[[joint]]
name = "X"
type = "linear"
min_mm = 20
max_mm = 100
velocity_mm_s = 15
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
[drives]
type = "simulated"
)";

SimulatedDrives::Config read(const std::string& keys) {
  const Machine machine = read_machine(parse_config(kMachine + keys, "test.toml"));
  return read_simulated_drives(machine, machine.root.table("drives"));
}

TEST(DriveConfig, KeysOfOneUnitAreThoseOfItsJoints) {
  const SimulatedDrives::Config config = read(R"(
natural_frequency_hz = 30
following_error_mm = 1.5
following_error_deg = 4
homing_speed_mm_s = 40
homing_speed_deg_s = 20
index_speed_mm_s = 3
index_speed_deg_s = 2
index_distance_mm = 5
limit_switch_margin_deg = 7
quick_stop_factor = 3
start_up_s = 0.0025
homing_timeout_s = 60
)");
  ASSERT_EQ(config.joints.size(), 2u);
  const SimulatedJoint::Config &x = config.joints[0], &c = config.joints[1];
  EXPECT_NEAR(x.servo.natural_frequency_rad_s, 360 * kDeg * 30, 1e-12);
  EXPECT_EQ(x.following_error_max, 1.5);
  EXPECT_NEAR(c.following_error_max, 4 * kDeg, 1e-15);
  EXPECT_EQ(x.speed_search, 15) << "no faster than the joint may move";
  EXPECT_NEAR(c.speed_search, 20 * kDeg, 1e-15);
  EXPECT_EQ(x.speed_index, 3);
  EXPECT_NEAR(c.speed_index, 2 * kDeg, 1e-15);
  EXPECT_EQ(x.index_distance, 5);
  EXPECT_NEAR(c.index_distance, 1 * kDeg, 1e-15);
  EXPECT_EQ(x.switch_min, 15);
  EXPECT_EQ(x.switch_max, 105);
  EXPECT_NEAR(c.switch_max, 187 * kDeg, 1e-12);
  EXPECT_NEAR(c.quick_stop_deceleration, 3 * 900 * kDeg, 1e-12);
  EXPECT_EQ(x.acceleration_homing, 1000);
  for (const SimulatedJoint::Config& joint : config.joints) {
    EXPECT_EQ(joint.start_up_periods, 3u) << "2.5 periods";
    EXPECT_EQ(joint.homing_periods_max, 60000u);
  }
}

TEST(DriveConfig, AJointStandsAtZeroOrAtTheNearestEndUnlessItIsTold) {
  const SimulatedDrives::Config plain = read("");
  EXPECT_EQ(plain.joints[0].start, 20);
  EXPECT_EQ(plain.joints[0].home, 20);
  EXPECT_EQ(plain.joints[1].start, 0);
  const SimulatedDrives::Config told = read(R"(
[[drives.joint]]
name = "C"
start_deg = -90
home_deg = 45
damping = 0.9
homed = false
)");
  EXPECT_NEAR(told.joints[1].start, -90 * kDeg, 1e-15);
  EXPECT_NEAR(told.joints[1].home, 45 * kDeg, 1e-15);
  EXPECT_FALSE(told.joints[1].homed);
  EXPECT_TRUE(told.joints[0].homed);
  EXPECT_EQ(told.joints[1].servo.damping, 0.9);
  EXPECT_NE(told.joints[0].servo.damping, 0.9);
  EXPECT_THROW(read("[[drives.joint]]\nname = \"C\"\nstart_deg = 181\n"), ConfigError);
  EXPECT_THROW(read("[[drives.joint]]\nname = \"Z\"\n"), ConfigError);
}

// -120 degrees come back from rad as -119.99999999999999.
TEST(DriveConfig, TheEndsOfARangeAreInItWhateverTheirDegrees) {
  std::string text = kMachine;
  const std::string ends = "min_deg = -180\nmax_deg = 180\n";
  const std::size_t at = text.find(ends);
  text.erase(at, ends.size());
  for (int tenths = 1; tenths <= 3600; tenths += 7) {
    const double end = tenths / 10.0;
    const auto read_with = [&](double start, double home) {
      std::string config = text;
      config.insert(at, fmt::format("min_deg = -{0}\nmax_deg = {0}\n", end));
      config += fmt::format("[[drives.joint]]\nname = \"C\"\nstart_deg = {}\nhome_deg = {}\n", start, home);
      const Machine machine = read_machine(parse_config(config, "test.toml"));
      const SimulatedJoint::Config joint =
          read_simulated_drives(machine, machine.root.table("drives")).joints[1];
      const JointLimit& limit = machine.joints[1].limit;
      EXPECT_EQ(joint.start, start < 0 ? limit.min : limit.max) << end;
      EXPECT_EQ(joint.home, home < 0 ? limit.min : limit.max) << end;
    };
    read_with(-end, end);
    read_with(end, -end);
    EXPECT_THROW(read_with(end + 1e-9, 0), ConfigError) << end;
    EXPECT_THROW(read_with(0, -end - 1e-9), ConfigError) << end;
  }
}

/// States and faults of the joint X, period by period, while C stands.
struct Script {
  explicit Script(const std::string& events) : drives(read(events)) {
    setpoints.q = setpoints.qd = JointVec::Zero(2);
    setpoints.q[0] = 50;
    drives.bring_up();
  }
  void until(int period) {
    for (; at < period; ++at) {
      if (feedback.q.size() == 2) setpoints.q[0] += speed_mm_s * 0.001;
      drives.exchange(setpoints, feedback);
      if (at == 0) setpoints.q[0] = feedback.q[0];
    }
  }
  SimulatedDrives drives;
  Setpoints setpoints;
  Feedback feedback;
  double speed_mm_s = 0;
  int at = 0;
};

std::string event(double at_s, const std::string& kind) {
  return "[[drives.script]]\nat_s = " + std::to_string(at_s) + "\njoint = \"X\"\nevent = \"" + kind + "\"\n";
}

TEST(DriveConfig, ALostDriveIsFoundAgain) {
  Script script(event(0.1, "lost") + event(0.2, "found"));
  script.until(100);
  EXPECT_EQ(script.feedback.state, DriveState::kEnabled);
  script.until(102);
  EXPECT_EQ(script.feedback.fault, Fault::kDriveLost);
  EXPECT_EQ(script.feedback.fault_joint, 0);
  script.until(200);
  EXPECT_EQ(script.feedback.fault, Fault::kDriveLost);
  script.until(202);
  EXPECT_NE(script.feedback.fault, Fault::kDriveLost);
}

TEST(DriveConfig, ADriveFaultsInItsPeriod) {
  Script script(event(0.1, "fault"));
  script.until(100);
  EXPECT_EQ(script.feedback.fault, Fault::kOk);
  script.until(101);
  EXPECT_EQ(script.feedback.fault, Fault::kDriveFault);
}

TEST(DriveConfig, AStuckAxisStandsUntilItIsFree) {
  Script script(event(0.2, "stuck") + event(0.3, "free") + "following_error_mm = 100\n");
  script.until(100);
  script.speed_mm_s = 10;
  script.until(200);
  const double stuck_mm = script.feedback.q[0];
  EXPECT_GT(stuck_mm, 20.5);
  script.until(300);
  EXPECT_NEAR(script.feedback.q[0], stuck_mm, 0.02);
  script.until(500);
  EXPECT_NEAR(script.feedback.q[0], script.setpoints.q[0], 0.05);
}

}  // namespace
}  // namespace trn
