#include "hal/can/can_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "core/machine.h"
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

}  // namespace
}  // namespace trn
