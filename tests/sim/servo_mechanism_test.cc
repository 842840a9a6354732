#include "sim/servo_mechanism.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

// The plain drive with its mechanism against closed forms.
namespace trn {
namespace {

constexpr double kPeriodS = 0.001;
using Loop = ServoMechanism::Reference::Loop;

ServoMechanism::Config one_mass() {
  ServoMechanism::Config config;
  config.period_s = kPeriodS;
  config.position_gain_1_s = 40;
  config.inertia = 0.4;  // 400 kg
  config.velocity_gain = 2 * M_PI * 60 * config.inertia;
  config.integral_time_s = 0.02;
  return config;
}

TEST(ServoMechanism, AForceMovesAMassAgainstFrictionAndWeight) {
  ServoMechanism::Config config = one_mass();
  config.coulomb = 150;
  config.gravity = 100;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  for (int i = 0; i < 500; ++i) joint.step(0, 0, {Loop::kTorque, 0, 450}, state);
  // 450 N less 150 N and 100 N over 400 kg is 0.5 m/s^2.
  EXPECT_NEAR(state.v, 500 * 0.5, 1e-6);
  EXPECT_NEAR(state.x, 500 * 0.5 * 0.5 / 2, 0.05);
  // What is less than friction holds it where it stands.
  state = {};
  for (int i = 0; i < 500; ++i) joint.step(0, 0, {Loop::kTorque, 0, 249}, state);
  EXPECT_EQ(state.x, 0);
}

TEST(ServoMechanism, ViscousFrictionLimitsTheSpeed) {
  ServoMechanism::Config config = one_mass();
  config.viscous = 2;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  for (int i = 0; i < 200; ++i) joint.step(0, 0, {Loop::kTorque, 0, 100}, state);
  // v = F / B (1 - exp(-B t / M)), with B / M = 5 a second.
  EXPECT_NEAR(state.v, 50 * (1 - std::exp(-5 * 0.2)), 0.01);
}

// A ramp of the place leaves a P position loop behind by v / gain; the velocity offset takes that away.
TEST(ServoMechanism, LagsByTheSpeedOverItsGainUnlessItIsToldTheSpeed) {
  const ServoMechanism joint(one_mass());
  for (const bool told : {false, true}) {
    ServoMechanism::State state;
    const double v = 200;
    double target = 0;
    for (int i = 0; i < 1000; ++i) {
      joint.step(target, target + v * kPeriodS, {Loop::kPosition, told ? v : 0, 0}, state);
      target += v * kPeriodS;
    }
    EXPECT_NEAR(target - state.x, told ? 0 : v / 40, 1e-3) << told;
  }
}

// Free, a motor and a load on a spring swing with the frequency that the config names.
TEST(ServoMechanism, SwingsAtItsResonance) {
  ServoMechanism::Config config = one_mass();
  config.resonance_rad_s = 2 * M_PI * 55;
  config.resonance_damping = 0.001;
  config.load_share = 0.7;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  state.v = 10;
  int crossings = 0;
  double first = 0, last = 0, before = 0;
  for (int i = 1; i <= 2000; ++i) {
    joint.step(0, 0, {Loop::kTorque, 0, 0}, state);
    const double apart = state.v - state.load_v;
    if (before < 0 && apart >= 0) {
      last = i - apart / (apart - before);
      if (crossings++ == 0) first = last;
    }
    before = apart;
  }
  EXPECT_NEAR((crossings - 1) / (1e-3 * (last - first)), 55, 0.3);
  // Nobody pushed: the momentum is still that of the beginning.
  EXPECT_NEAR(0.3 * state.v + 0.7 * state.load_v, 0.3 * 10, 1e-6);
}

TEST(ServoMechanism, TurnsRoundThroughItsBacklash) {
  ServoMechanism::Config config = one_mass();
  config.resonance_rad_s = 2 * M_PI * 80;
  config.resonance_damping = 0.1;
  config.backlash = 0.04;
  config.coulomb = 100;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  double target = 0, top = 0;
  const auto drive = [&](double v, int periods) {
    for (int i = 0; i < periods; ++i, target += v * kPeriodS)
      joint.step(target, target + v * kPeriodS, {}, state);
  };
  drive(5, 1000);
  drive(0, 1000);
  top = state.x - state.load_x;
  drive(-5, 1000);
  drive(0, 1000);
  EXPECT_GT(top, 0.019);
  EXPECT_LT(top, 0.025) << "half of the backlash, and what friction stretches the spring by";
  EXPECT_LT(state.x - state.load_x, -0.019);
}

TEST(ServoMechanism, MakesNoMoreThanItsGreatestForce) {
  ServoMechanism::Config config = one_mass();
  config.force_max = 500;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  double most = 0;
  for (int i = 0; i < 3000; ++i) {
    joint.step(50, 50, {}, state);
    most = std::max(most, std::abs(state.force));
  }
  EXPECT_EQ(most, 500);
  EXPECT_NEAR(state.x, 50, 0.01);
}

}  // namespace
}  // namespace trn
