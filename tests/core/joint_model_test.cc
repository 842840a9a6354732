#include "core/joint_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/config.h"
#include "core/machine.h"
#include "core/units.h"

// What the model of a joint asks of its motor, and the section that describes it.
namespace trn {
namespace {

const std::string kHead =
    "[machine]\nname = \"m\"\nperiod_s = 0.001\n"
    "[[joint]]\nname = \"X\"\ntype = \"linear\"\nmin_mm = -100\nmax_mm = 100\nvelocity_mm_s = 500\n"
    "acceleration_mm_s2 = 5000\njerk_mm_s3 = 100000\n"
    "[[joint]]\nname = \"A\"\ntype = \"rotary\"\nmin_deg = -90\nmax_deg = 90\nvelocity_deg_s = 120\n"
    "acceleration_deg_s2 = 800\njerk_deg_s3 = 16000\n";

FeedForwardConfig read(const std::string& section) {
  const auto config = read_feed_forward(read_machine(parse_config(kHead + section, "m.toml")));
  EXPECT_TRUE(config);
  return config.value_or(FeedForwardConfig{});
}

std::string error_of(const std::string& section) {
  try {
    read(section);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(JointModel, OfALinearJointIsNewtonAndFriction) {
  const FeedForwardConfig config = read(
      "[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\ninertia_kg = 200\nviscous_N_s_mm = 0.5\n"
      "coulomb_N = 80\ngravity_N = 100\n");
  ASSERT_TRUE(config.models[0]);
  const JointModel& x = *config.models[0];
  // 200 kg at 5 m/s^2 are 1000 N; 100 mm/s at 0.5 N s/mm are 50 N.
  EXPECT_NEAR(x.force(0, 100, 5000), 1000 + 50 + 80 + 100, 1e-9);
  EXPECT_NEAR(x.force(0, -100, 0), -50 - 80 + 100, 1e-9);
  EXPECT_NEAR(x.force(0, 0, 0), 100, 1e-9);
  // Between rest and coulomb_speed, which is 0.1 mm/s, friction grows evenly.
  EXPECT_NEAR(x.force(0, 0.05, 0), 100 + 40 + 0.025, 1e-9);
  EXPECT_FALSE(config.models[1]);
  EXPECT_EQ(config.delay_periods, -0.5);
  EXPECT_TRUE(config.velocity && config.torque);
}

TEST(JointModel, OfARotaryJointKnowsWhereItIsHeavy) {
  const FeedForwardConfig config = read(
      "[feed_forward]\ndelay_periods = 1.25\n[[feed_forward.joint]]\njoint = \"A\"\ninertia_kg_m2 = 3\n"
      "imbalance_Nm = 20\nimbalance_at_deg = 30\n");
  const JointModel& a = *config.models[1];
  EXPECT_NEAR(a.force(30 * kRadPerDeg, 0, 0), 20, 1e-9);
  EXPECT_NEAR(a.force(-60 * kRadPerDeg, 0, 0), 0, 1e-9);
  EXPECT_NEAR(a.force(90 * kRadPerDeg, 0, 2), 20 * std::cos(60 * kRadPerDeg) + 6, 1e-9);
}

TEST(JointModel, AskedForNothingButMassItAsksForNothingElse) {
  const FeedForwardConfig config =
      read("[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\ninertia_kg = 200\n");
  EXPECT_EQ(config.models[0]->force(40, 250, 0), 0) << "no friction, no weight, no cogging";
}

TEST(JointModel, CoggingRepeatsAndIsLinearBetweenItsPlaces) {
  const FeedForwardConfig config = read(
      "[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\ncogging_pitch_mm = 24\ncogging_N = [0, 12, -6, "
      "3]\n");
  const JointModel& x = *config.models[0];
  EXPECT_NEAR(x.force(6, 0, 0), 12, 1e-9);
  EXPECT_NEAR(x.force(9, 0, 0), 3, 1e-9);
  EXPECT_NEAR(x.force(21, 0, 0), 1.5, 1e-9);
  EXPECT_NEAR(x.force(-3 - 24 * 5, 0, 0), 1.5, 1e-9);
  EXPECT_NEAR(x.force(24 * 1e6 + 6, 0, 0), 12, 1e-6);
}

TEST(JointModel, BadSectionsAreRefusedWhereTheyAre) {
  EXPECT_FALSE(read_feed_forward(read_machine(parse_config(kHead, "m.toml"))));
  EXPECT_NE(error_of("[feed_forward]\ndelay_periods = -1.5\n").find("m.toml:21:17: "), std::string::npos)
      << error_of("[feed_forward]\ndelay_periods = -1.5\n");
  for (const char* beyond : {"360.5", "-360.5"}) {
    const std::string error = error_of(
        std::string("[feed_forward]\n[[feed_forward.joint]]\njoint = \"A\"\nimbalance_at_deg = ") + beyond);
    EXPECT_NE(error.find("m.toml:23:20: "), std::string::npos) << error;
  }
  const std::string twice =
      "[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\n[[feed_forward.joint]]\njoint = \"X\"\n";
  EXPECT_NE(error_of(twice).find("'X' has a model already"), std::string::npos);
  EXPECT_NE(error_of("[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\ncogging_pitch_mm = 3\n")
                .find("needs its table 'cogging_N'"),
            std::string::npos);
  EXPECT_NE(error_of("[feed_forward]\n[[feed_forward.joint]]\njoint = \"X\"\ncogging_pitch_mm = 3\n"
                     "cogging_N = [1]\n")
                .find("2 to 4096"),
            std::string::npos);
}

}  // namespace
}  // namespace trn
