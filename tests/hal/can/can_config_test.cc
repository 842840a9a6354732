#include "hal/can/can_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/machine.h"
#include "hal/can/node_setup.h"
#include "hal/can/sdo.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// The cradle's config when `text` stands at the end of its first node.
CanDrivesConfig cradle_with(const std::string& text) {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  std::string config{std::istreambuf_iterator<char>(in), {}};
  config.insert(config.find("[[drives.node]]", config.find("[[drives.node]]") + 1), text);
  const ConfigTable root = parse_config(config, source_dir() + "/configs/cradle_can.toml");
  return read_can_drives(read_machine(root), root.table("drives"));
}

/// The message with which it is refused.
std::string refusal(const std::string& text) {
  try {
    cradle_with(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string write_of(const std::string& index, const std::string& sub, const std::string& value) {
  return "[[drives.node.write]]\nindex = " + index + "\nsub = " + sub + "\nvalue = " + value + "\n";
}

TEST(CanConfig, ARampBeyondItsObjectIsTheSteepest) {
  for (const char* factor : {"1e9", "1e300"}) {
    const CanDrivesConfig config = cradle_with(std::string("quick_stop_factor = ") + factor + "\n");
    int found = 0;
    for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps) {
      if (step.key != ObjectKey{0x6085, 0}) continue;
      EXPECT_EQ(step.bytes, (std::vector<std::uint8_t>{0xFF, 0xFF, 0xFF, 0xFF})) << factor;
      ++found;
    }
    EXPECT_EQ(found, 1);
  }
}

TEST(CanConfig, WritesAreOfObjectsThatThereAre) {
  EXPECT_EQ(refusal(""), "");
  EXPECT_EQ(refusal(write_of("0x6099", "1", "1000")), "");
  EXPECT_NE(refusal(write_of("0x6099", "256", "0")).find("255"), std::string::npos)
      << refusal(write_of("0x6099", "256", "0"));
  EXPECT_NE(refusal(write_of("0x6099", "255", "0")).find("object 0x6099:255 does not exist"),
            std::string::npos)
      << refusal(write_of("0x6099", "255", "0"));
  EXPECT_NE(refusal(write_of("0x6041", "0", "0")).find("object 0x6041:0 cannot be written"),
            std::string::npos)
      << refusal(write_of("0x6041", "0", "0"));
  EXPECT_NE(refusal(write_of("0x0FFF", "0", "0")), "");
}

TEST(CanConfig, WhatIsSkippedIsAnObject) {
  EXPECT_EQ(refusal("skip = [\"0x6085\", \"0x60c2:2\"]\n"), "");
  for (const char* bad : {"6085", "0x60C2:256", "0x60C2:", "0x123456", "quick stop", ""})
    EXPECT_NE(refusal(std::string("skip = [\"") + bad + "\"]\n").find("is no object"), std::string::npos)
        << bad;
}

TEST(CanConfig, TheInterpolationPeriodIsThatOfTheMachine) {
  EXPECT_EQ(refusal("interpolation_period = [20, -4]\n"), "") << "2 ms";
  for (const char* bad : {"[2, -4]", "[2]", "[0.5, -3]", "[2000, -6]"})
    EXPECT_NE(refusal(std::string("interpolation_period = ") + bad + "\n").find("must be machine.period_s"),
              std::string::npos)
        << bad;
  const CanDrivesConfig config = cradle_with("interpolation_period = [20, -4]\n");
  for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps) {
    if (step.key == ObjectKey{0x60C2, 1}) {
      EXPECT_EQ(step.bytes.at(0), 20);
    }
    if (step.key == ObjectKey{0x60C2, 2}) {
      EXPECT_EQ(static_cast<std::int8_t>(step.bytes.at(0)), -4);
    }
  }
}

// servo.eds: product 0x402, and a vendor of 0, which says nothing
TEST(CanConfig, IdentityIsTheDataSheetsUnlessTheConfigSaysOtherwise) {
  const auto checks = [](const std::string& text) {
    std::vector<std::uint64_t> out;
    const CanDrivesConfig config = cradle_with(text);
    for (const SetupStep& step : config.buses.at(0).nodes.at(0).setup.steps)
      if (step.key.index == 0x1018) out.insert(out.end(), {step.key.sub, get_le(step.bytes.data(), 4)});
    return out;
  };
  EXPECT_EQ(checks(""), (std::vector<std::uint64_t>{2, 0x402}));
  EXPECT_EQ(checks("vendor = 7\nproduct = 0\n"), (std::vector<std::uint64_t>{1, 7}));
}

}  // namespace
}  // namespace trn
