#include "kernel/spindle_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"

// The spindle that is a joint, against a drive that does at once what it is told, or a number of periods
// later.
namespace trn {
namespace {

constexpr double kPeriod_s = 0.001;
constexpr JointLimit kLimit{.min = -1e9, .max = 1e9, .velocity = 320, .acceleration = 600, .jerk = 12000};

struct Bench {
  explicit Bench(int feedback_periods = 0)
      : spindle({0, {"C", JointKind::kRotary, kLimit, true}, -1, kPeriod_s, feedback_periods}, nullptr),
        late(feedback_periods) {}

  void period() {
    Setpoints setpoints;
    setpoints.q.setConstant(1, plan);
    setpoints.qd.setZero(1);
    setpoints.velocity_offset.setZero(1);
    spindle.turn(setpoints, true);
    if (state == DriveState::kEnabled) told.push_back(setpoints.q[0]);
    forward.push_back(setpoints.velocity_offset[0]);
    Feedback feedback;
    const std::size_t age = std::min(static_cast<std::size_t>(late) + 1, told.size());
    feedback.q.setConstant(1, state == DriveState::kEnabled && age > 0 ? told[told.size() - age] : coasts);
    feedback.state = state;
    spindle.turn_back(feedback);
    heard = feedback.q[0];
    const IoPlace place{feedback.q, tool};
    spindle.exchange(outputs, place, inputs);
  }
  void run(double time_s) {
    for (double t = 0; t < time_s; t += kPeriod_s) period();
  }
  /// Until the spindle says so; the periods that it took.
  int until_ready() {
    int n = 0;
    do period();
    while (!inputs.spindle_ready && ++n < 100000);
    return n;
  }

  SpindleAxis spindle;
  int late;
  double plan = 0, heard = 0, coasts = 0;
  DriveState state = DriveState::kEnabled;
  std::vector<double> told, forward;
  IoOutputs outputs;
  IoInputs inputs;
  Vec3 tool = Vec3::Zero();
};

/// The greatest n-th difference over the period's n-th power.
double greatest(std::vector<double> values, int n) {
  for (; n > 0; --n) {
    for (std::size_t i = 0; i + 1 < values.size(); ++i) values[i] = (values[i + 1] - values[i]) / kPeriod_s;
    values.pop_back();
  }
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

TEST(SpindleAxis, TurnsAtTheSpeedWithinTheLimitsOfItsJoint) {
  Bench bench;
  bench.run(0.01);
  for (const double rpm : {600.0, -2900.0, 3000.0, 0.5, 0.0}) {
    bench.outputs.spindle_rpm = rpm;
    bench.until_ready();
    EXPECT_NEAR(bench.spindle.speed_rad_s(), -rpm * 2 * kPi / 60, rpm == 3000 ? 320 * 0.02 : 1e-9);
    bench.run(0.02);
  }
  EXPECT_LT(greatest(bench.told, 1), kLimit.velocity);
  EXPECT_LT(greatest(bench.told, 2), kLimit.acceleration);
  EXPECT_LT(greatest(bench.told, 3), kLimit.jerk * 1.0001);
  EXPECT_GT(greatest(bench.told, 2), 0.85 * kLimit.acceleration);
  // Feed-forward tells the drive the same speed.
  for (std::size_t i = 1; i < bench.told.size(); ++i)
    EXPECT_NEAR(bench.forward[i], (bench.told[i] - bench.told[i - 1]) / kPeriod_s, 1e-6);
  EXPECT_EQ(bench.heard, 0);  // nobody else sees it
}

TEST(SpindleAxis, StandsAtAnAngleAndMakesWholeTurnsAsAnAxis) {
  Bench bench;
  bench.plan = rad_from_deg(50);
  bench.outputs.spindle_rpm = 1234;
  bench.until_ready();
  bench.run(0.1234);
  bench.outputs.spindle_rpm = 0;
  bench.outputs.spindle_orients = true;
  bench.outputs.spindle_deg = 90;  // M19 R90: clockwise
  bench.until_ready();
  EXPECT_NEAR(std::remainder(bench.told.back() + rad_from_deg(90), 2 * kPi), 0, 1e-9);
  EXPECT_NEAR(bench.inputs.spindle_turns * 360 - 90,
              360 * std::round((bench.inputs.spindle_turns * 360 - 90) / 360), 1e-6);
  // As an axis at C50: whole turns to the last bit, so that the joint goes on where the plan has it.
  bench.outputs.spindle_deg = -50;
  bench.until_ready();
  EXPECT_EQ(bench.spindle.turn_rad(), 2 * kPi * std::round(bench.spindle.turn_rad() / (2 * kPi)));
  const double turn = bench.spindle.turn_rad();
  for (int i = 0; i < 100; ++i) {
    bench.plan += 0.01;
    bench.period();
    EXPECT_EQ(bench.told.back(), bench.plan + turn);
    EXPECT_NEAR(bench.heard, bench.plan, 1e-9);
  }
  EXPECT_TRUE(bench.inputs.spindle_ready);
  EXPECT_LT(greatest({bench.told.begin(), bench.told.end() - 101}, 3), kLimit.jerk * 1.0001);
  EXPECT_LT(greatest({bench.told.begin(), bench.told.end() - 101}, 2), kLimit.acceleration);
}

// The same angle again, after the axis has moved away from it.
TEST(SpindleAxis, GoesBackToAnAngleThatItHasLeftAsAnAxis) {
  Bench bench;
  bench.outputs.spindle_orients = true;
  bench.until_ready();
  bench.plan = 1;
  bench.run(0.01);
  bench.outputs.spindle_orients = false;  // M155
  bench.run(0.01);
  bench.outputs.spindle_orients = true;  // M19 R0
  bench.until_ready();
  EXPECT_NEAR(std::remainder(bench.told.back(), 2 * kPi), 0, 1e-9);
}

// A new speed while it goes to an angle: it goes there first.
TEST(SpindleAxis, NeverLeapsWhateverItIsTold) {
  Bench bench;
  std::uint64_t seed = 7;
  const auto random = [&](int n) {
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<int>((seed >> 33) % static_cast<std::uint64_t>(n));
  };
  for (int i = 0; i < 400; ++i) {
    bench.outputs.spindle_orients = random(3) == 0;
    bench.outputs.spindle_rpm = bench.outputs.spindle_orients ? 0 : 100 * (random(61) - 30);
    bench.outputs.spindle_deg = random(360);
    bench.run(0.001 * random(200));
  }
  EXPECT_LT(greatest(bench.told, 1), kLimit.velocity);
  EXPECT_LT(greatest(bench.told, 2), kLimit.acceleration);
  EXPECT_LT(greatest(bench.told, 3), kLimit.jerk * 1.0001);
}

// A feedback of three periods ago is compared with the turn of that time.
TEST(SpindleAxis, TheFeedbackHasTheTurnOfItsOwnTime) {
  Bench bench(3);
  bench.plan = 2;
  bench.outputs.spindle_rpm = 3000;
  for (int i = 0; i < 1500; ++i) {
    bench.period();
    if (i > 5) {
      EXPECT_NEAR(bench.heard, 2, 1e-9);
    }
  }
}

TEST(SpindleAxis, ADriveThatBrakesByItselfLeavesThePlanWhereItIs) {
  Bench bench;
  bench.plan = 0.5;
  bench.outputs.spindle_rpm = 900;
  bench.until_ready();
  bench.state = DriveState::kQuickStop;
  bench.coasts = bench.told.back();
  for (int i = 0; i < 100; ++i) {
    bench.coasts -= 0.05;
    bench.outputs = {};
    bench.period();
    EXPECT_NEAR(bench.heard, 0.5, 1e-12);
  }
  bench.state = DriveState::kEnabled;
  bench.period();
  EXPECT_NEAR(bench.told.back(), bench.coasts, 1e-9);  // no jump
  bench.state = DriveState::kHoming;
  bench.coasts = 0.25;
  bench.period();
  EXPECT_NEAR(bench.heard, 0.25, 1e-12);  // what homing finds is the axis' own place
}

}  // namespace
}  // namespace trn
