#include "hal/modbus/field_devices.h"

#include <gtest/gtest.h>

#include <string>

#include "core/config.h"

// Section [modbus] and its arithmetic; the devices at work are tested against emulated ones.
namespace trn {
namespace {

std::string config_text(int values, const std::string& device_keys, const std::string& address) {
  std::string text = "[modbus]\n[[modbus.line]]\nname = \"a\"\naddress = \"" + address +
                     "\"\n[[modbus.device]]\nname = \"box\"\n" + device_keys;
  for (int i = 0; i < values; ++i)
    text += "[[modbus.device.value]]\nname = \"v" + std::to_string(i) +
            "\"\ntable = \"input\"\naddress = " + std::to_string(i) + "\n";
  return text;
}
std::string refusal(const std::string& text) {
  try {
    read_modbus(parse_config(text, "m.toml"));
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

// A request has 8 characters and its answer 7, with a silence of 3.5 around each; a character has 11 bits.
TEST(FieldDevicesConfig, APollTakesTheLinesTime) {
  ModbusDeviceConfig device;
  device.values.resize(6);
  EXPECT_NEAR(poll_time_s(parse_modbus_address("rtu:/dev/x:9600"), device), 6 * 22 * 11 / 9600.0, 1e-12);
  EXPECT_EQ(poll_time_s(parse_modbus_address("tcp:cabinet"), device), 0);
}

// 151.25 ms in 100 ms; 70 % are allowed, so 216.07 ms would do.
TEST(FieldDevicesConfig, ALineMustHaveTimeForItsPolls) {
  const std::string text = refusal(config_text(6, "poll_s = 0.1\n", "rtu:/dev/x:9600"));
  for (const char* part :
       {"line 'a' would be busy 151 % of the time", "box: 151.2 ms every 100 ms", "longer by 2.16 times"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  EXPECT_EQ(refusal(config_text(6, "poll_s = 0.217\n", "rtu:/dev/x:9600")), "");
  EXPECT_NE(refusal(config_text(6, "poll_s = 0.215\n", "rtu:/dev/x:9600")), "");
  EXPECT_EQ(refusal(config_text(6, "poll_s = 0.1\n", "tcp:cabinet")), "");
}

TEST(FieldDevicesConfig, WhatIsNotSaidIsAsDocumented) {
  const ModbusConfig config = read_modbus(parse_config(config_text(1, "", "tcp:a"), "m.toml"));
  ASSERT_EQ(config.lines.size(), 1u);
  EXPECT_EQ(config.lines[0].timeout_s, 0.2);
  ASSERT_EQ(config.devices.size(), 1u);
  const ModbusDeviceConfig& device = config.devices[0];
  EXPECT_EQ(device.unit, 1);
  EXPECT_EQ(device.poll_s, 0.2);
  EXPECT_EQ(device.stale_s, 1.0);
  EXPECT_EQ(device.retries, 2);
  EXPECT_TRUE(device.required);
  ASSERT_EQ(device.values.size(), 1u);
  EXPECT_EQ(device.values[0].name, "box.v0");
  EXPECT_FALSE(device.values[0].is_signed);
  EXPECT_EQ(device.values[0].scale, 1);
}

TEST(FieldDevicesConfig, WhatCannotBeIsRefused) {
  EXPECT_NE(refusal(config_text(1, "poll_s = 0.2\nstale_s = 0.2\n", "tcp:a")).find("stale_s"),
            std::string::npos);
  EXPECT_EQ(refusal(config_text(1, "poll_s = 0.2\nstale_s = 0.21\n", "tcp:a")), "");
  EXPECT_NE(refusal(config_text(1, "unit = 248\n", "tcp:a")), "");
  const std::string value = config_text(1, "", "tcp:a");
  EXPECT_NE(refusal(value + "scale = 0\n"), "");
  EXPECT_NE(refusal(value + "min = 2\nmax = 1\n").find("max"), std::string::npos);
  EXPECT_NE(refusal(config_text(1, "", "tcp:")).find("is no Modbus address"), std::string::npos);
  EXPECT_TRUE(read_modbus(parse_config("", "m.toml")).lines.empty());
}

// Sixteen bits hold 0 to 65535, with a sign -32768 to 32767, each times the scale (protocol 1.1b3, 4.3).
TEST(FieldDevicesConfig, ALimitMustBeOneThatTheRegisterCanReach) {
  const std::string value = config_text(1, "", "tcp:a");
  EXPECT_NE(refusal(value + "max = 70000\n")
                .find("'max' = 70000 does not fit the register, which holds 0 to 65535"),
            std::string::npos)
      << refusal(value + "max = 70000\n");
  EXPECT_EQ(refusal(value + "max = 65535\n"), "");
  EXPECT_EQ(refusal(value + "max = 131070\nscale = 2\n"), "");
  EXPECT_NE(refusal(value + "max = 32767\nscale = 0.1\n"), "");
  EXPECT_NE(refusal(value + "min = -20\nmax = 120\n").find("'signed'"), std::string::npos) << "no sign";
  EXPECT_EQ(refusal(value + "min = -20\nmax = 120\nsigned = true\n"), "");
  EXPECT_EQ(refusal(value + "min = -100\nmax = 0\nscale = -0.01\n"), "");
  EXPECT_NE(refusal(value + "min = -1000\nmax = 1\nscale = -0.01\n"), "");
}

TEST(FieldDevicesConfig, OneMeaningOfARegisterHasOneName) {
  const std::string again = "[[modbus.device.value]]\nname = \"again\"\ntable = \"input\"\naddress = 0\n";
  const std::string text = config_text(1, "", "tcp:a") + again;
  EXPECT_NE(refusal(text).find("'box.v0' and 'box.again' are the same input 0"), std::string::npos)
      << refusal(text);
  EXPECT_EQ(refusal(text + "signed = true\n"), "") << "another meaning";
}

}  // namespace
}  // namespace trn
