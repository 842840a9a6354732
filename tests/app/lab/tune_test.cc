#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "app/lab/tune/tune_bode.h"
#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_fit.h"
#include "app/lab/tune/tune_plan.h"
#include "app/lab/tune/tune_report.h"
#include "app/lab/tune/tune_run.h"
#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/joint_model.h"
#include "core/units.h"
#include "sim/servo_mechanism.h"
#include "tests/support/paths.h"

// A joint's model found again from its motion: against the emulated machine, which shares nothing with the
// fit.
namespace trn {
namespace {

using Edits = std::vector<std::pair<std::string, std::string>>;

Assembly machine(const Edits& edits = {}) {
  const std::string path = source_dir() + "/configs/cradle_servo.toml";
  std::ifstream in(path);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  return assemble(parse_config(text, path));
}

struct Tuned {
  Joint joint;
  TunePlan plan;
  TuneData data;
  TuneResult result;
};

Tuned tuned(int index, const Edits& edits = {}) {
  Assembly assembly = machine(edits);
  Tuned out;
  out.joint = assembly.machine.joints[static_cast<std::size_t>(index)];
  out.data = tune_emulated(assembly, index, [&](double stands) {
    out.plan = plan_tuning(out.joint, stands, {});
    return out.plan;
  });
  out.result.fit = fit_joint(out.data, out.joint);
  out.result.lost_motion = lost_motion(out.data, out.result.fit, out.plan.first_slow);
  out.result.loop = measure_loop(out.data, out.result.fit, out.joint);
  std::printf("%s", tune_text(out.result, out.joint).c_str());
  return out;
}

struct Truth {
  int joint;
  double inertia, viscous, coulomb, gravity, imbalance;
};

class Tuning : public testing::TestWithParam<Truth> {};

// Inertia within 1 %, friction within 3 %, weight within 1 % of what the motor can hold.
TEST_P(Tuning, FindsTheEmulatedMachineAgain) {
  const Truth truth = GetParam();
  const TuneFit fit = tuned(truth.joint).result.fit;
  EXPECT_NEAR(fit.inertia.value, truth.inertia, 0.01 * truth.inertia);
  EXPECT_NEAR(fit.viscous.value, truth.viscous, 0.03 * truth.viscous);
  EXPECT_NEAR(fit.coulomb.value, truth.coulomb, 0.03 * truth.coulomb);
  EXPECT_NEAR(fit.gravity.value, truth.gravity, 0.01 * truth.gravity + 0.02 * truth.coulomb);
  if (truth.imbalance > 0) {
    EXPECT_NEAR(fit.imbalance_sin.value, truth.imbalance, 0.02 * truth.imbalance);
    EXPECT_NEAR(fit.imbalance_cos.value, 0, 0.02 * truth.imbalance);
  }
  EXPECT_GT(fit.explained, 0.999);
  // The deviations are of the size of the errors: not far too small, and not so large that they say nothing.
  EXPECT_LT(std::abs(fit.inertia.value - truth.inertia), 6 * fit.inertia.deviation + 0.003 * truth.inertia);
  EXPECT_LT(fit.inertia.deviation, 0.01 * truth.inertia);
  EXPECT_LT(fit.coulomb.deviation, 0.03 * truth.coulomb);
}

// As the config's emulation has them; tonnes are N over mm/s^2.
INSTANTIATE_TEST_SUITE_P(Joints, Tuning,
                         testing::Values(Truth{0, 0.420, 0.9, 180, 0, 0}, Truth{2, 0.180, 0.6, 120, 600, 0},
                                         Truth{3, 4.5, 3, 12, 0, 18}, Truth{4, 1.2, 0.8, 5, 0, 0}),
                         [](const auto& param) { return "Joint" + std::to_string(param.param.joint); });

TEST(TuningOfASoftJoint, FindsResonancePlayAndTheJerkThatLeavesNoSwing) {
  const double resonance_hz = 45, backlash_mm = 0.04, load_share = 0.6;
  const Tuned soft = tuned(
      0, {{"[drives.emulation.joint.mechanism]\ninertia_kg = 420.0",
           "[drives.emulation.joint.mechanism]\ninertia_kg = 420.0\nresonance_hz = 45.0\nload_share = 0.6\n"
           "backlash_mm = 0.04\nresonance_damping = 0.03"}});
  // Held by its motor the load swings at the spring's own frequency over the load: the resonance times the
  // root of the motor's share.
  const double swing_hz = resonance_hz * std::sqrt(1 - load_share);
  ASSERT_TRUE(soft.result.loop.swing_hz);
  EXPECT_NEAR(*soft.result.loop.swing_hz, swing_hz, 0.1 * swing_hz);
  ASSERT_TRUE(soft.result.loop.resonance_hz);
  EXPECT_NEAR(*soft.result.loop.resonance_hz, resonance_hz, 0.1 * resonance_hz);
  // The motor goes through the play, and winds the spring up from one friction to the other.
  const double mass = 0.42, reduced = mass * load_share * (1 - load_share);
  const double stiffness = reduced * std::pow(2 * kPi * resonance_hz, 2);
  const double least = backlash_mm, most = backlash_mm + 2 * 180 / stiffness;
  ASSERT_TRUE(soft.result.lost_motion);
  EXPECT_GT(soft.result.lost_motion->value, 0.9 * least);
  EXPECT_LT(soft.result.lost_motion->value, 1.1 * most);
  const auto jerk = recommended_jerk(soft.result.loop, soft.joint);
  ASSERT_TRUE(jerk);
  EXPECT_NEAR(*jerk, soft.joint.limit.acceleration * swing_hz, 0.1 * *jerk);
}

TEST(TuningOfAStiffJoint, SeesNoResonanceAndNoPlay) {
  const Tuned stiff = tuned(0);
  EXPECT_FALSE(stiff.result.loop.swing_hz) << *stiff.result.loop.swing_hz;
  EXPECT_FALSE(stiff.result.loop.resonance_hz) << *stiff.result.loop.resonance_hz;
  EXPECT_FALSE(recommended_jerk(stiff.result.loop, stiff.joint));
  ASSERT_TRUE(stiff.result.lost_motion);
  EXPECT_LT(stiff.result.lost_motion->value, 0.003);
  // The position loop has a gain of 40 a second: 3 dB down at about 40 / (2 pi) Hz.
  ASSERT_TRUE(stiff.result.loop.bandwidth_hz);
  EXPECT_NEAR(*stiff.result.loop.bandwidth_hz, 40 / (2 * kPi), 2.5);
}

/// How far the load swings behind an acceleration that comes up within `ramp_s`, mm.
double swing_behind(double ramp_s) {
  ServoMechanism::Config config;
  config.period_s = 0.001;
  config.position_gain_1_s = 40;
  config.inertia = 0.42;
  config.velocity_gain = 2 * kPi * 60 * config.inertia;
  config.integral_time_s = 0.02;
  config.resonance_rad_s = 2 * kPi * 45;
  config.load_share = 0.6;
  config.resonance_damping = 0.005;
  const ServoMechanism joint(config);
  ServoMechanism::State state;
  double q = 0, v = 0, least = 1e9, most = -1e9;
  const double a_max = 2000;
  for (int k = 0; k < 400; ++k) {
    const double t = k * 0.001, a = a_max * std::min(1.0, t / ramp_s), before = q;
    q += 0.001 * (v + 0.0005 * a);
    v += 0.001 * a;
    joint.step(before, q, {ServoMechanism::Reference::Loop::kPosition, v, 0.42 * a}, state);
    if (k < 150) continue;
    least = std::min(least, state.x - state.load_x);
    most = std::max(most, state.x - state.load_x);
  }
  return most - least;
}

// What is recommended, tried out: a ramp of one swing against a shorter one.
TEST(RecommendedJerk, LeavesLittleSwingBehind) {
  const double swing_hz = 45 * std::sqrt(0.4);
  const double shorter = swing_behind(0.35 / swing_hz), recommended = swing_behind(1 / swing_hz);
  std::printf("    swing behind the ramp: %.5f mm, with the recommended jerk %.5f mm\n", shorter,
              recommended);
  EXPECT_LT(recommended, shorter / 3);
}

TEST(TunePlanning, StaysInTheRangeAndSaysSo) {
  const Assembly assembly = machine();
  for (const Joint& joint : assembly.machine.joints)
    for (const double part : {0.05, 0.5, 0.9}) {
      const double stands = joint.limit.min + part * (joint.limit.max - joint.limit.min);
      const TunePlan plan = plan_tuning(joint, stands, {});
      double place = stands;
      for (const TuneStroke& stroke : plan.strokes) {
        place += stroke.way;
        EXPECT_GT(place, joint.limit.min);
        EXPECT_LT(place, joint.limit.max);
        EXPECT_LE(stroke.speed, joint.limit.velocity);
        EXPECT_GE(place, plan.from - 1e-9);
        EXPECT_LE(place, plan.to + 1e-9);
      }
      EXPECT_NEAR(place, stands, 1e-9) << "it ends where it began";
      EXPECT_LT(plan.time_s, 120);
    }
  const Joint& x = assembly.machine.joints[0];
  EXPECT_THROW(plan_tuning(x, 0, {1000, 0.6}), std::runtime_error);
  EXPECT_NE(announcement(plan_tuning(x, 0, {50, 0.3}), x).find("between 0.0 and 50.0 mm"), std::string::npos)
      << announcement(plan_tuning(x, 0, {50, 0.3}), x);
}

TEST(TuneFitting, SaysWhatIsMissingWithoutATorque) {
  TuneData data;
  data.period_s = 0.001;
  for (int k = 0; k < 3000; ++k) {
    data.measured.push_back(0.1 * k);
    data.setpoint.push_back(0.1 * k);
    data.force.push_back(std::nan(""));
    data.stroke.push_back(0);
  }
  try {
    fit_joint(data, machine().machine.joints[0]);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("'torque = true'"), std::string::npos);
  }
}

// What it writes is a table that the reader takes, with the values that were found.
TEST(TuneReport, WritesATableOfTheConfig) {
  const Assembly assembly = machine();
  TuneResult result;
  result.fit.inertia = {0.42, 0.001};
  result.fit.viscous = {0.9, 0.01};
  result.fit.coulomb = {180, 2};
  result.fit.gravity = {1, 3};  // not certain: it stays out
  const Joint& joint = assembly.machine.joints[0];
  const std::string section = tune_config(result, joint);
  EXPECT_EQ(section.find("gravity"), std::string::npos);
  const std::string head =
      "[machine]\nname = \"m\"\nperiod_s = 0.001\n[[joint]]\nname = \"X\"\ntype = \"linear\"\nmin_mm = 0\n"
      "max_mm = 1\nvelocity_mm_s = 1\nacceleration_mm_s2 = 1\njerk_mm_s3 = 1\n[feed_forward]\n";
  const auto config = read_feed_forward(read_machine(parse_config(head + section, "t.toml")));
  ASSERT_TRUE(config && config->models[0]);
  EXPECT_NEAR(config->models[0]->inertia, 0.42, 1e-9);
  EXPECT_NEAR(config->models[0]->coulomb, 180, 1e-9);
}

}  // namespace
}  // namespace trn
