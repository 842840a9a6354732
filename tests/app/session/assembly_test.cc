#include "app/session/assembly.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/ports.h"
#include "tests/support/paths.h"

// Machines put together from the configs that are shipped, with lines of them changed.
namespace trn {
namespace {

std::string mill() {
  std::ifstream in(source_dir() + "/configs/mill.toml");
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string with(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return text.replace(at, old.size(), now);
}

Assembly assembled(const std::string& text) { return assemble(parse_config(text, "m.toml")); }

std::string refusal(const std::string& text) {
  try {
    assembled(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

// Corrections take from the ranges and rates that are planned with, and never add to them.
TEST(Assembly, EveryShippedMachineIsPutTogether) {
  for (const std::string& path : shipped_configs()) {
    const Assembly assembly = assemble(path);
    const std::size_t joints = assembly.machine.joints.size();
    ASSERT_EQ(assembly.plan_joints.size(), joints) << path;
    EXPECT_EQ(static_cast<std::size_t>(assembly.kinematics->joint_count()), joints) << path;
    EXPECT_EQ(assembly.lcm.machine, assembly.machine.name) << path;
    for (std::size_t i = 0; i < joints; ++i) {
      const JointLimit& machine = assembly.machine.joints[i].limit;
      const JointLimit& plan = assembly.plan_joints[i].limit;
      EXPECT_EQ(assembly.plan_joints[i].name, assembly.machine.joints[i].name) << path;
      EXPECT_GE(plan.min, machine.min) << path;
      EXPECT_LE(plan.max, machine.max) << path;
      EXPECT_LE(plan.velocity, machine.velocity) << path;
      EXPECT_LE(plan.acceleration, machine.acceleration) << path;
      EXPECT_LE(plan.jerk, machine.jerk) << path;
      EXPECT_LT(plan.min, plan.max) << path;
    }
  }
}

TEST(Assembly, AKeyThatNobodyKnowsIsNamed) {
  EXPECT_EQ(refusal(mill()), "");
  for (const char* section : {"[planner]\n", "[drives]\n", "[program]\n", "[io.spindle]\n", "[machine]\n"}) {
    const std::string told = refusal(with(mill(), section, section + std::string("no_such_key = 1\n")));
    EXPECT_NE(told.find("no_such_key"), std::string::npos) << section << told;
    EXPECT_EQ(told.substr(0, 7), "m.toml:") << told;
  }
  EXPECT_NE(refusal(mill() + "\n[no_such_section]\n").find("no_such_section"), std::string::npos);
}

TEST(Assembly, ADrawingIsOfAPartOfTheMachineAndStopsNoMachine) {
  const auto drawing = [](const std::string& part) {
    return "\n[[drawing]]\npart = \"" + part + "\"\nstl = \"nowhere.stl\"\n";
  };
  for (const char* part : {"base", "table", "spindle", "Z"})
    EXPECT_EQ(refusal(mill() + drawing(part)), "") << part;
  const std::string told = refusal(mill() + drawing("W"));
  EXPECT_NE(told.find("'drawing[0].part' = \"W\" is not legal"), std::string::npos) << told;
  EXPECT_NE(told.find("base, table, spindle, X, Y, Z"), std::string::npos) << told;
}

TEST(Planner, IsReadWithItsBounds) {
  const auto read = [](const std::string& keys) {
    return read_planner(parse_config("[planner]\n" + keys, "t"));
  };
  const PlannerConfig silent = read_planner(parse_config("", "t"));
  EXPECT_EQ(silent.buffer_s, 1);
  EXPECT_EQ(silent.tolerance_mm_max, 1);
  const PlannerConfig said = read(
      "compress = false\nacceleration_share = 0.5\njerk_share = 0.995\ntolerance_mm_max = 0.25\nbuffer_s = "
      "10\n");
  EXPECT_FALSE(said.geometry.compress);
  EXPECT_EQ(said.speed.acceleration_share, 0.5);
  EXPECT_EQ(said.speed.jerk_share, 0.995);
  EXPECT_EQ(said.tolerance_mm_max, 0.25);
  EXPECT_EQ(said.buffer_s, 10);
  for (const char* bad : {"acceleration_share = 0.49", "acceleration_share = 0.996", "jerk_share = 0.49",
                          "jerk_share = 0.996", "tolerance_mm_max = 0", "buffer_s = 0.49", "buffer_s = 10.1"})
    EXPECT_THROW(read(bad), ConfigError) << bad;
}

// At 400 mm/s a fortieth of the jerk takes more than a second to stop: from v to rest with the jerk J alone,
// 2 sqrt(v / J), and four of those must be ahead of the tick.
TEST(Assembly, FourStopsAreAlwaysPlannedAhead) {
  EXPECT_EQ(assembled(with(mill(), "[planner]\n", "[planner]\nbuffer_s = 5\n")).planner.buffer_s, 5)
      << "enough";
  std::string slow = mill();
  for (int i = 0; i < 2; ++i) slow = with(slow, "jerk_mm_s3 = 80000.0", "jerk_mm_s3 = 2000.0");
  const double stop_s = 2 * std::sqrt(400.0 / 2000);
  EXPECT_GE(assembled(slow).planner.buffer_s, 4 * stop_s);
}

TEST(Assembly, LoopbackDrivesStandAtZeroOrAtTheNearerEndOfTheRange) {
  std::string text = with(mill(), "type = \"simulated\"", "type = \"loopback\"");
  text = with(text, "min_mm = -300.0", "min_mm = 12.5");
  text = with(text, "max_mm = 200.0", "max_mm = -7.5");
  const JointVec q = standing_joints(assembled(text));
  ASSERT_EQ(q.size(), 3);
  EXPECT_EQ(q[0], 12.5);
  EXPECT_EQ(q[1], -7.5);
  EXPECT_EQ(q[2], 0);
}

TEST(Assembly, AnotherPeriodIsThatOfAllItsParts) {
  Assembly assembly = assembled(mill());
  EXPECT_EQ(assembly.machine.period_s, 0.001);
  const Drives* before = assembly.drives.get();
  set_period(assembly, 0.00025);
  EXPECT_EQ(assembly.machine.period_s, 0.00025);
  EXPECT_NE(assembly.drives.get(), before);
  EXPECT_NE(assembly.map, nullptr);
  EXPECT_NE(assembly.io, nullptr);
}

TEST(Assembly, OnlyAMachineWithASectionForItHasIo) {
  const Assembly assembly = assembled(mill());
  ASSERT_NE(assembly.io, nullptr);
  EXPECT_EQ(assembly.spindle_timeout_s, 10);
  EXPECT_EQ(assembled(with(mill(), "[io]\n", "[io]\nspindle_timeout_s = 3.5\n")).spindle_timeout_s, 3.5);
  const std::string text = mill();
  EXPECT_EQ(assembled(text.substr(0, text.find("[io]"))).io, nullptr);
}

// 18,200 degrees a second are 3033 turns a minute, of which a spindle takes 99 %.
TEST(Assembly, ASpindleThatIsAnAxisTurnsAsFastAsItsJointMay) {
  const Assembly assembly = assemble(source_dir() + "/configs/spindle_axis.toml");
  EXPECT_NEAR(assembly.program.spindle_axis.rpm_max, 0.99 * 18200 * 60 / 360, 0.01);
}

// Whose words are angles on a circle: an axis that the machine has.
TEST(Assembly, WrapsAnAxisThatThereIs) {
  const std::string path = source_dir() + "/configs/cradle.toml";
  std::ifstream in(path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto wrapped = [&](const std::string& axes) {
    std::string edited = text;
    const std::string section = "[program]\n";
    edited.replace(edited.find(section), section.size(), section + "wrapped = [" + axes + "]\n");
    return assemble(parse_config(edited, path));
  };
  EXPECT_NO_THROW(wrapped("\"C\""));
  try {
    wrapped("\"B\"");
    FAIL() << "the cradle has no B";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("'B' is no axis of this machine; its rotary axes: A C"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace trn
