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
#include "app/lab/tune/tune_stirred.h"
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

Tuned tuned(int index, const Edits& edits = {}, const TuneWish& wish = {}) {
  Assembly assembly = machine(edits);
  Tuned out;
  out.joint = assembly.machine.joints[static_cast<std::size_t>(index)];
  out.data = tune_emulated(assembly, index, [&](double stands) {
    out.plan = plan_tuning(out.joint, stands, wish);
    return out.plan;
  });
  out.result.fit = fit_joint(out.data, out.joint, wish.cogging_pitch);
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

constexpr double kResonanceHz = 45, kLoadShare = 0.6;

Edits soft_x(const std::string& more) {
  const std::string head = "[drives.emulation.joint.mechanism]\ninertia_kg = 420.0";
  return {{head, head + "\nresonance_hz = 45.0\nload_share = 0.6\nresonance_damping = 0.03\n" + more}};
}

// Held by its motor the load swings at the spring's own frequency over the load: the resonance times the root
// of the motor's share.
TEST(TuningOfASoftJoint, FindsWhereTheLoadSwingsAndTheJerkForIt) {
  const double swing_hz = kResonanceHz * std::sqrt(1 - kLoadShare);
  for (const char* play : {"", "backlash_mm = 0.01"}) {
    const Tuned soft = tuned(0, soft_x(play));
    ASSERT_TRUE(soft.result.loop.swing_hz) << play;
    EXPECT_NEAR(*soft.result.loop.swing_hz, swing_hz, 0.1 * swing_hz) << play;
    const auto jerk = recommended_jerk(soft.result.loop, soft.joint);
    ASSERT_TRUE(jerk);
    EXPECT_NEAR(*jerk, soft.joint.limit.acceleration * swing_hz, 0.1 * *jerk);
  }
}

// The motor goes through the play, and winds the spring up from one friction to the other.
TEST(TuningOfASoftJoint, FindsItsPlay) {
  const double mass = 0.42, reduced = mass * kLoadShare * (1 - kLoadShare);
  const double stiffness = reduced * std::pow(2 * kPi * kResonanceHz, 2), wind_up = 2 * 180 / stiffness;
  for (const auto& [text, play] : {std::pair{"", 0.0}, std::pair{"backlash_mm = 0.04", 0.04}}) {
    const Tuned soft = tuned(0, soft_x(text));
    ASSERT_TRUE(soft.result.lost_motion);
    EXPECT_GT(soft.result.lost_motion->value, play + 0.7 * wind_up) << text;
    EXPECT_LT(soft.result.lost_motion->value, play + 1.0 * wind_up) << text;
  }
}

/// X with more keys in its mechanism.
Edits with_x(const std::string& more) {
  const std::string head = "[drives.emulation.joint.mechanism]\ninertia_kg = 420.0";
  return {{head, head + "\n" + more}};
}

// Above 50 Hz no jog stirs anything; shaken by a tenth of the force of its acceleration it shows what swings.
// The emulated spring shares nothing with the model: it is stepped 40 times a swing.
TEST(TuningOfAShakenJoint, FindsResonancesUpToWhatThePeriodAllows) {
  TuneWish wish;
  wish.stirs = true;
  for (const double hz : {80.0, 120.0, 180.0}) {
    const std::string keys =
        "resonance_hz = " + std::to_string(hz) + "\nload_share = 0.5\nresonance_damping = 0.02\n";
    const Tuned soft = tuned(0, with_x(keys), wish);
    ASSERT_TRUE(soft.result.loop.stirred) << hz;
    const StirredLoop& found = *soft.result.loop.stirred;
    std::printf("%g Hz: off by %+.2f %%, damping %.3f, share %.2f\n", hz, 100 * (found.resonance_hz / hz - 1),
                found.damping, found.share);
    EXPECT_NEAR(found.resonance_hz, hz, 0.02 * hz);
    EXPECT_NEAR(found.share, 0.5, 0.1) << hz;
    EXPECT_GT(found.seen_up_to_hz, 250) << hz;
    EXPECT_EQ(found.nyquist_hz, 500);
    ASSERT_TRUE(soft.result.loop.swing_hz);
    EXPECT_NEAR(*soft.result.loop.swing_hz, hz * std::sqrt(0.5), 0.08 * hz);
    // The mass is that of both, whatever swings.
    EXPECT_NEAR(soft.result.fit.inertia.value, 0.42, 0.01 * 0.42) << hz;
  }
}

TEST(TuningOfAShakenJoint, SaysThatNothingSwingsInARigidOne) {
  TuneWish wish;
  wish.stirs = true;
  const Tuned rigid = tuned(0, {}, wish);
  ASSERT_TRUE(rigid.result.loop.stirred);
  EXPECT_EQ(rigid.result.loop.stirred->resonance_hz, 0);
  EXPECT_NE(tune_text(rigid.result, rigid.joint).find("nothing swings"), std::string::npos);
}

// The emulated motor has waves, one and two in a pitch, each with a place of its own.
TEST(TuningOfACoggingJoint, FindsTheTableAgain) {
  const double pitch = 30, first = 20, second = 8;
  TuneWish wish;
  wish.cogging_pitch = pitch;
  const Tuned cogs =
      tuned(0, with_x("cogging_pitch_mm = 30\ncogging_N = [20, 8]\ncogging_at_mm = [3, 11]\n"), wish);
  EXPECT_TRUE(cogs.result.fit.cogs());
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    const double q = pitch * i / 300;
    const double truth =
        first * std::cos(2 * kPi * (q - 3) / pitch) + second * std::cos(4 * kPi * (q - 11) / pitch);
    worst = std::max(worst, std::abs(cogs.result.fit.cogging_at(q) - truth));
  }
  std::printf("cogging of 20 and 8 N: off by %.2f N at most\n", worst);
  EXPECT_LT(worst, 0.05 * first);
  EXPECT_NEAR(cogs.result.fit.coulomb.value, 180, 0.03 * 180);
  EXPECT_NEAR(cogs.result.fit.inertia.value, 0.42, 0.01 * 0.42);
  // What is written is read back as the model: linear between 64 places.
  const std::string text = tune_config(cogs.result, cogs.joint);
  EXPECT_NE(text.find("cogging_pitch_mm = 30\ncogging_N = ["), std::string::npos) << text;
  Assembly read =
      machine({{"coulomb_N = 176.0\n", "coulomb_N = 176.0\n" + text.substr(text.find("cogging_pitch_mm"))}});
  ASSERT_TRUE(read.feed_forward);
  const auto model = read_feed_forward(read.machine);
  ASSERT_TRUE(model && model->models[0]);
  for (const double q : {0.0, 3.3, -41.7, 88.1})
    EXPECT_NEAR(model->models[0]->force_at_rest(q) - model->models[0]->gravity, cogs.result.fit.cogging_at(q),
                0.2)
        << q;
}

TEST(TuningOfACoggingJoint, FindsNoneWhereThereIsNone) {
  TuneWish wish;
  wish.cogging_pitch = 30;
  const Tuned smooth = tuned(0, {}, wish);
  EXPECT_EQ(tune_config(smooth.result, smooth.joint).find("cogging"), std::string::npos);
  wish.cogging_pitch = 300;  // two pitches are more than it goes
  Assembly assembly = machine();
  try {
    plan_tuning(assembly.machine.joints[0], 0, wish);
    FAIL() << "no way for two pitches";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("needs two pitches of way, 600 mm"), std::string::npos)
        << error.what();
  }
}

/// Where a loop of P on the position and PI on the velocity, about a mass, is 3 dB down.
double loop_bandwidth_hz() {
  const double kp = 40, kv = 2 * kPi * 60, ti = 0.02;  // of the config's emulation; kv over the mass
  double hz = 1;
  const auto size = [&](double f) {
    const std::complex<double> s(0, 2 * kPi * f), pi = kv * (1.0 + 1.0 / (s * ti)), v = pi / (s + pi);
    return std::abs(kp * v / (s + kp * v));
  };
  while (size(hz) > std::sqrt(0.5)) hz += 0.001;
  return hz;
}

TEST(TuningOfAStiffJoint, SeesNoResonanceAndNoPlay) {
  const Tuned stiff = tuned(0);
  EXPECT_FALSE(stiff.result.loop.swing_hz);
  EXPECT_FALSE(stiff.result.loop.resonance_hz);
  EXPECT_FALSE(recommended_jerk(stiff.result.loop, stiff.joint));
  EXPECT_GT(stiff.result.loop.seen_up_to_hz, 30);
  // What moves masses moves all of them.
  const FrequencyResponse& mechanics = stiff.result.loop.mechanics;
  for (std::size_t i = 0; i < mechanics.hz.size() && mechanics.hz[i] < 25; ++i)
    EXPECT_NEAR(std::abs(mechanics.h[i]), 1, 0.02) << mechanics.hz[i];
  ASSERT_TRUE(stiff.result.lost_motion);
  EXPECT_LT(stiff.result.lost_motion->value, 0.003);
  ASSERT_TRUE(stiff.result.loop.bandwidth_hz);
  EXPECT_NEAR(*stiff.result.loop.bandwidth_hz, loop_bandwidth_hz(), 0.08 * loop_bandwidth_hz());
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

// In other units of force, or of a motor a thousand times weaker, the model is the same but for its size.
TEST(TuneFitting, FitsASmallMotorAsWellAsALargeOne) {
  const Tuned large = tuned(3);
  TuneData weak = large.data;
  for (double& force : weak.force) force *= 1e-3;
  const TuneFit small = fit_joint(weak, large.joint, 0);
  EXPECT_NEAR(small.explained, large.result.fit.explained, 1e-6);
  EXPECT_NEAR(small.inertia.value, 1e-3 * large.result.fit.inertia.value, 1e-6 * small.inertia.value);
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
