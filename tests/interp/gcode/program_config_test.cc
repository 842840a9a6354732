#include "tests/interp/gcode/run_program.h"

// The section [program]: what it says, and what is refused.
namespace trn {
namespace {

ProgramConfig config_of(const std::string& text) { return read_program_config(parse_config(text, "m.toml")); }

std::string refusal(const std::string& text) {
  try {
    config_of(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

TEST(ProgramConfig, HasDefaultsOfItsOwn) {
  const ProgramConfig config = config_of("");
  EXPECT_EQ(config.path_mode, MotionControl::kContinuous);
  EXPECT_EQ(config.gouge_check, GougeCheckMode::kError);
  EXPECT_FALSE(config.io);
  EXPECT_FALSE(config.spindle_encoder);
  const ProgramConfig empty = config_of("[program]\n");
  ASSERT_EQ(empty.words.size(), 3U);
  EXPECT_EQ(empty.words[2].text, "cycle832");
}

TEST(ProgramConfig, EveryKeyIsRead) {
  const ProgramConfig config = config_of(R"([io]
[io.spindle]
acceleration_rpm_s = 1500
[program]
path_mode = "G61.1"
tolerance_mm = 0.02
arc_tolerance_mm = 0.1
safe_z_mm = 120
gouge_check = "warning"
block_delete = true
wrapped = ["A", "C"]
rtcp_on = ["TRAORI", "M128"]
rtcp_off = ["trafoof", "M129"]
ignored = []
user_m = ["M110"]
sub_path = ["subs"]
line_length_max = 100
[[program.m_code]]
code = "M111"
call = "Touch"
[[program.m_code]]
code = "M112"
output = 5
on = false
)");
  EXPECT_TRUE(config.spindle_encoder);
  EXPECT_EQ(config.spindle_rpm_s, 1500);
  EXPECT_EQ(config.path_mode, MotionControl::kExactStop);
  EXPECT_EQ(config.tolerance_mm, 0.02);
  EXPECT_EQ(config.safe_z_mm, 120);
  EXPECT_EQ(config.gouge_check, GougeCheckMode::kWarning);
  EXPECT_EQ(config_of("[program]\ngouge_check = \"off\"\n").gouge_check, GougeCheckMode::kOff);
  EXPECT_TRUE(config.block_delete);
  EXPECT_EQ(config.wrapped_mask, 1U << kA | 1U << kC);
  ASSERT_EQ(config.words.size(), 6U);
  EXPECT_EQ(config.words[1].m_code, 128);
  EXPECT_EQ(config.words[2].text, "trafoof");
  ASSERT_EQ(config.user_m.size(), 3U);
  EXPECT_EQ(config.user_m[1].call, "touch");
  EXPECT_EQ(config.user_m[2].output, 5);
  EXPECT_FALSE(config.user_m[2].on);
  EXPECT_EQ(config.line_length_max, 100U);
  EXPECT_EQ(config_of("[program]\npath_mode = \"G61\"\n").path_mode, MotionControl::kExactPath);
  EXPECT_FALSE(config_of("[io]\n[io.spindle]\nencoder = false\n").spindle_encoder);
  EXPECT_FALSE(config_of("[io]\ntype = \"modbus\"\n[io.spindle]\n").spindle_encoder);
  EXPECT_THROW(config_of("[io]\ntype = \"modbus\"\n[io.spindle]\nencoder = true\n"), ConfigError);
}

TEST(ProgramConfig, WhatCannotBeIsRefused) {
  const auto expect = [](const std::string& line, const std::string& part) {
    const std::string text = refusal("[program]\n" + line + "\n");
    EXPECT_NE(text.find(part), std::string::npos) << line << ": " << text;
    EXPECT_EQ(text.rfind("m.toml:", 0), 0U) << text;
  };
  expect("path_mode = \"G62\"", "G61");
  expect("gouge_check = \"perhaps\"", "warning");
  expect("wrapped = [\"X\"]", "'X' is no rotary axis");
  expect("wrapped = [\"AB\"]", "'AB' is no rotary axis");
  expect("rtcp_on = [\"1X\"]", "'1X' is no word");
  expect("rtcp_on = [\"T\"]", "'T' is no word");
  expect("rtcp_on = [\"M1000\"]", "out of range");
  expect("rtcp_on = [\"M3\"]", "already has a meaning");
  expect("rtcp_on = [\"M0\"]", "already has a meaning");
  expect("rtcp_on = [\"M128\"]\nrtcp_off = [\"m128\"]", "mapped twice");
  expect("user_m = [\"M3\"]", "cannot be a user code");
  expect("user_m = [\"X\"]", "cannot be a user code");
  expect("[[program.m_code]]\ncode = \"M111\"", "needs either call or output");
  for (const char* code : {"M3", "M30", "M98", "M1000", "G10", "M"})
    expect("[[program.m_code]]\noutput = 1\ncode = \"" + std::string(code) + "\"",
           "cannot be a user code; legal: M0 to M999, unused");
  expect("[[program.m_code]]\ncode = \"M111\"\ncall = \"a\"\noutput = 1", "needs either call or output");
  expect("tolerance_mm = 0", "tolerance_mm");
  expect("line_length_max = 10", "line_length_max");
}

TEST(ProgramConfig, AWordHasTwoLettersAtLeast) {
  EXPECT_NO_THROW(config_of("[program]\nrtcp_on = [\"TR\"]\n"));
  EXPECT_THROW(config_of("[program]\nrtcp_on = [\"T\"]\n"), ConfigError);
  EXPECT_THROW(config_of("[program]\nrtcp_on = [\"T1\"]\n"), ConfigError);
}

TEST(ProgramConfig, CodesOfCorrectionsAreFree) {
  ProgramConfig config = config_of("[program]\nuser_m = [\"M110\"]\nrtcp_on = [\"M128\"]\n");
  const auto code = [&](const std::string& spelt) {
    const ConfigTable table = parse_config("m_on = \"" + spelt + "\"\n", "m.toml");
    return read_free_m(table, "m_on", config);
  };
  EXPECT_EQ(code("M150"), 150);
  for (const char* taken : {"M3", "M110", "M128", "M1000", "Q1"})
    EXPECT_THROW(code(taken), ConfigError) << taken;
  config.switches.push_back({150, true, 1});
  EXPECT_THROW(code("M150"), ConfigError);
}

}  // namespace
}  // namespace trn
