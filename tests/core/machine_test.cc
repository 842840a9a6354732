#include "core/machine.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

namespace trn {
namespace {

std::string joint(const std::string& name, double min = -10, double max = 20) {
  return fmt::format(
      "[[joint]]\nname = \"{}\"\ntype = \"linear\"\nmin_mm = {:.4f}\nmax_mm = {:.4f}\nvelocity_mm_s = 500\n"
      "acceleration_mm_s2 = 4000\njerk_mm_s3 = 80000\n",
      name, min, max);
}

std::string machine(const std::string& joints, const std::string& period = "0.002") {
  return fmt::format("[machine]\nname = \"m\"\nperiod_s = {}\n{}", period, joints);
}

std::string refusal(const std::string& text) {
  try {
    read_machine(parse_config(text, "m.toml"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(Machine, LengthsStayAndAnglesBecomeRadians) {
  const std::string rotary =
      "[[joint]]\nname = \"A\"\ntype = \"rotary\"\nmin_deg = -90\nmax_deg = 180\nvelocity_deg_s = 36\n"
      "acceleration_deg_s2 = 360\njerk_deg_s3 = 3600\n";
  const Machine read = read_machine(parse_config(machine(joint("X") + rotary), "m.toml"));
  EXPECT_EQ(read.name, "m");
  EXPECT_EQ(read.period_s, 0.002);
  ASSERT_EQ(read.joints.size(), 2u);
  const Joint &x = read.joints[0], &a = read.joints[1];
  EXPECT_EQ(x.kind, JointKind::kLinear);
  EXPECT_EQ(x.limit.min, -10);
  EXPECT_EQ(x.limit.max, 20);
  EXPECT_EQ(x.limit.velocity, 500);
  EXPECT_EQ(x.limit.acceleration, 4000);
  EXPECT_EQ(x.limit.jerk, 80000);
  constexpr double kDeg = 3.14159265358979323846 / 180;
  EXPECT_EQ(a.kind, JointKind::kRotary);
  EXPECT_NEAR(a.limit.min, -90 * kDeg, 1e-15);
  EXPECT_NEAR(a.limit.max, 180 * kDeg, 1e-15);
  EXPECT_NEAR(a.limit.velocity, 36 * kDeg, 1e-15);
  EXPECT_NEAR(a.limit.acceleration, 360 * kDeg, 1e-14);
  EXPECT_NEAR(a.limit.jerk, 3600 * kDeg, 1e-13);
}

TEST(Machine, LimitsMustLieInOrder) {
  EXPECT_EQ(refusal(machine(joint("X", 1, 1.001))), "");
  EXPECT_NE(refusal(machine(joint("X", 1, 1))).find("the upper limit must lie above the lower limit"),
            std::string::npos);
  EXPECT_NE(refusal(machine(joint("X", 2, 1))).find("the upper limit must lie above the lower limit"),
            std::string::npos);
}

TEST(Machine, JointsAreOneToTheMostAndHaveNamesOfTheirOwn) {
  std::string most;
  for (int i = 0; i < kMaxJoints; ++i) most += joint(fmt::format("J{}", i));
  EXPECT_EQ(refusal(machine(most)), "");
  EXPECT_NE(refusal(machine(most + joint("K"))).find("a machine has 1 to"), std::string::npos);
  EXPECT_NE(refusal(machine("")), "");
  EXPECT_NE(refusal(machine(joint("X") + joint("Y") + joint("X"))).find("two joints are named 'X'"),
            std::string::npos);
}

// A name heads a column of the trace, between commas, and stands in signals between points.
TEST(Machine, NamesOfJointsFitIntoTracesAndSignals) {
  for (const char* legal : {"X", "x", "leg1", "rail_2", "Y-left", "Achse_\xc3\xbc"})
    EXPECT_EQ(refusal(machine(joint(legal))), "") << legal;
  for (const char* bad : {"", "X,Y", " X", "X Y", "X.Y", "X=1", "X'"})
    EXPECT_NE(
        refusal(machine(joint(bad)))
            .find("m.toml:5:8: \"" + std::string(bad) + "\" cannot be the name of a joint; letters, digits"),
        std::string::npos)
        << bad << ": " << refusal(machine(joint(bad)));
  for (const char* column : {"t_s", "p_x", "u_k", "line", "load_known", "piece"})
    EXPECT_NE(refusal(machine(joint("X") + joint(column))).find("is a column of every trace already"),
              std::string::npos)
        << column;
}

TEST(Machine, ThePeriodIsTenMicrosecondsToATenthOfASecond) {
  for (const char* legal : {"1e-5", "0.1"}) EXPECT_EQ(refusal(machine(joint("X"), legal)), "") << legal;
  for (const char* bad : {"0.9e-5", "0.101", "0.0", "-0.001"})
    EXPECT_NE(refusal(machine(joint("X"), bad)).find("period_s"), std::string::npos) << bad;
}

}  // namespace
}  // namespace trn
