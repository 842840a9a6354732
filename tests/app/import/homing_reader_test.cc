#include "app/import/homing_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "app/import/imported_machine.h"
#include "core/ports.h"
#include "core/units.h"
#include "sim/simulated_joint.h"

namespace trn {
namespace {

constexpr double kFrequency_hz = 40;  // the drives' defaults, docs/config.md

ImportedJoint joint_of(double min, double max, double velocity, double acceleration, double search,
                       double latch) {
  ImportedJoint joint;
  joint.min = min;
  joint.max = max;
  joint.velocity = velocity;
  joint.acceleration = acceleration;
  joint.search_speed = search;
  joint.latch_speed = latch;
  joint.searches = true;
  return joint;
}

/// Where the simulated drive itself stands after homing that begins at `start`; NaN if it fails.
double homed_at(const ImportedJoint& joint, const SimulatedHoming& homing, double start, double period_s) {
  SimulatedJoint::Config config;
  config.servo = {2 * kPi * kFrequency_hz, 0.7, 1, period_s};
  config.following_error_max = 2;
  config.quick_stop_deceleration = 2 * joint.acceleration;
  config.acceleration_homing = joint.acceleration;
  config.speed_search = std::min(homing.search_speed, joint.velocity);
  config.speed_index = std::min(homing.index_speed, joint.velocity);
  config.home = homing.home;
  config.index_distance = homing.index_distance;
  config.switch_min = joint.min - 5;
  config.switch_max = joint.max + 5;
  config.start = start;
  // The config gives it twice this time.
  config.homing_periods_max = static_cast<std::uint32_t>(1.2 * search_time_s(joint, homing) / period_s);
  SimulatedJoint drive(config);
  drive.enable();
  for (int i = 0; i < 10; ++i) drive.step(drive.measured());
  drive.home();
  for (std::uint32_t i = 0; i <= config.homing_periods_max && !drive.homed(); ++i)
    drive.step(drive.measured());
  return drive.homed() ? drive.true_place() : NAN;
}

// The drive is the judge: from HOME and from either end of its range it ends inside the range, at HOME, and
// before the time that the import says is over.
TEST(HomingReader, TheDriveStandsAtHomeInsideItsRange) {
  for (const double period_s : {0.0005, 0.001, 0.002})
    for (const double acceleration : {30.0, 500.0, 5000.0})
      for (const double search : {0.5, 5.0, 40.0, 200.0})
        for (const double latch : {0.0, 0.2, 5.0, 200.0})
          for (const double home : {-150.0, -149.9, -20.0, -0.3, 0.0}) {
            const ImportedJoint joint = joint_of(-150, 0, 100, acceleration, search, latch);
            const SimulatedHoming homing = simulated_homing(joint, home, period_s);
            EXPECT_GE(homing.home, joint.min);
            EXPECT_GT(homing.index_distance, 0);
            // At the lower end there is no room for the switch; it ends as far above as it brakes.
            const double v = homing.search_speed, brake = v * v / (2 * acceleration) + 6 * v * period_s;
            const bool room = home - joint.min > brake + 0.2;
            const double near = 0.01 + brake / 500;  // the way from the switch to the index has to end
            for (const double start : {home, joint.min, joint.max}) {
              const double at = homed_at(joint, homing, start, period_s);
              EXPECT_GE(at, joint.min) << search << " " << latch << " " << home << " " << start;
              EXPECT_LE(at, joint.max) << search << " " << latch << " " << home << " " << start;
              EXPECT_NEAR(at, home, room ? near : brake + 0.2)
                  << period_s << " " << acceleration << " " << search << " " << latch << " " << start;
            }
          }
}

TEST(HomingReader, AShortRangeIsSearchedSlowly) {
  for (const double range : {0.5, 2.0, 10.0})
    for (const double share : {0.0, 0.5, 1.0}) {
      const ImportedJoint joint = joint_of(-range, 0, 100, 500, 100, 50);
      const SimulatedHoming homing = simulated_homing(joint, -range * share, 0.001);
      for (const double start : {-range, 0.0}) {
        const double at = homed_at(joint, homing, start, 0.001);
        EXPECT_GE(at, joint.min) << range << " " << share;
        EXPECT_LE(at, joint.max) << range << " " << share;
      }
    }
}

}  // namespace
}  // namespace trn
