#include "hal/can/can_config.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "core/machine.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// The message with which the cradle's config is refused when `text` stands at the end of its first node.
std::string refusal(const std::string& text) {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  std::string config{std::istreambuf_iterator<char>(in), {}};
  config.insert(config.find("[[drives.node]]", config.find("[[drives.node]]") + 1), text);
  try {
    const ConfigTable root = parse_config(config, source_dir() + "/configs/cradle_can.toml");
    const Machine machine = read_machine(root);
    read_can_drives(machine, root.table("drives"));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

std::string write_of(const std::string& index, const std::string& sub, const std::string& value) {
  return "[[drives.node.write]]\nindex = " + index + "\nsub = " + sub + "\nvalue = " + value + "\n";
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
