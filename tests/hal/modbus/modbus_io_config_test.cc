#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/config.h"
#include "hal/modbus/modbus_io.h"

// Section [io] of type "modbus": which values of which devices are the machine's inputs and outputs.
namespace trn {
namespace {

constexpr char kDevices[] = R"(
[modbus]
[[modbus.line]]
name = "a"
address = "tcp:cabinet"
[[modbus.device]]
name = "box"
[[modbus.device.value]]
name = "coil"
table = "coil"
address = 0
[[modbus.device.value]]
name = "switch"
table = "discrete"
address = 0
[[modbus.device.value]]
name = "input"
table = "input"
address = 0
[[modbus.device.value]]
name = "holding"
table = "holding"
address = 0
[[modbus.device.value]]
name = "start"
table = "coil"
address = 1
[[modbus.device.value]]
name = "rpm"
table = "holding"
address = 1
)";

ModbusIoConfig read(const std::string& io) {
  return read_modbus_io(parse_config(kDevices + ("[io]\ntype = \"modbus\"\n" + io), "io.toml"));
}
std::string refusal(const std::string& io) {
  try {
    read(io);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

// A coil and a holding register can be written, the other two only read (protocol 1.1b3, 4.3).
TEST(ModbusIoConfig, OutputsAreWhatCanBeWritten) {
  for (const std::string name : {"coil", "switch", "input", "holding"}) {
    const bool writable = name == "coil" || name == "holding";
    for (const std::string key : {"digital_outputs", "analog_outputs"})
      EXPECT_EQ(refusal(key + " = [\"box." + name + "\"]\n").empty(), writable) << key << " " << name;
    for (const std::string key : {"digital_inputs", "analog_inputs"})
      EXPECT_EQ(refusal(key + " = [\"box." + name + "\"]\n"), "") << key << " " << name;
    for (const std::string key : {"mist", "flood"})
      EXPECT_EQ(refusal(key + " = \"box." + name + "\"\n").empty(), writable) << key << " " << name;
    for (const std::string key : {"speed", "run"})
      EXPECT_EQ(refusal("[io.spindle]\n" + key + " = \"box." + name + "\"\n").empty(), writable) << key;
    for (const std::string key : {"reverse", "actual", "at_speed", "fault"})
      EXPECT_EQ(refusal("[io.spindle]\nrun = \"box.start\"\n" + key + " = \"box." + name + "\"\n").empty(),
                writable || key != "reverse")
          << key << " " << name;
  }
}

TEST(ModbusIoConfig, NamesStandInTheirOrder) {
  const ModbusIoConfig config = read(R"(
digital_inputs = ["box.switch", "box.coil"]
analog_outputs = ["box.holding"]
flood = "box.coil"
[io.spindle]
speed = "box.rpm"
actual = "box.input"
tolerance_rpm = 12
)");
  EXPECT_EQ(config.digital_inputs, (std::vector<std::string>{"box.switch", "box.coil"}));
  EXPECT_EQ(config.analog_outputs, std::vector<std::string>{"box.holding"});
  EXPECT_TRUE(config.digital_outputs.empty());
  EXPECT_EQ(config.flood, "box.coil");
  EXPECT_EQ(config.mist, "");
  EXPECT_EQ(config.spindle.speed, "box.rpm");
  EXPECT_EQ(config.spindle.actual, "box.input");
  EXPECT_EQ(config.spindle.tolerance_rpm, 12);
}

TEST(ModbusIoConfig, WhatCannotBeIsRefused) {
  EXPECT_NE(refusal("digital_inputs = [\"box.swich\"]\n").find("did you mean 'box.switch'?"),
            std::string::npos);
  EXPECT_NE(refusal("[io.spindle]\nactual = \"box.input\"\n").find("nothing could turn it"),
            std::string::npos);
  const auto many = [](int count) {
    std::string names;
    for (int i = 0; i < count; ++i) names += "\"box.coil\", ";
    return "digital_inputs = [" + names + "]\n";
  };
  EXPECT_EQ(refusal(many(64)), "");
  EXPECT_NE(refusal(many(65)), "");
  EXPECT_THROW(read_modbus_io(parse_config("[io]\ntype = \"modbus\"\n", "io.toml")), ConfigError)
      << "no device";
  EXPECT_TRUE(read_modbus_io(parse_config("[io]\ntype = \"simulated\"\n", "io.toml")).devices.lines.empty());
}

// Two outputs on one coil would switch it on and off, two hundred times a second.
TEST(ModbusIoConfig, TheRegisterOfAnOutputHasOneWriter) {
  const std::string text = refusal("digital_outputs = [\"box.coil\"]\nmist = \"box.coil\"\n");
  EXPECT_NE(text.find("'box.coil' is written by 'digital_outputs' already"), std::string::npos) << text;
  EXPECT_NE(refusal("digital_outputs = [\"box.coil\"]\n[io.spindle]\nrun = \"box.coil\"\n"), "");
  EXPECT_NE(refusal("analog_outputs = [\"box.holding\", \"box.holding\"]\n"), "");
  EXPECT_EQ(refusal("mist = \"box.coil\"\nflood = \"box.coil\"\n"), "") << "one pump";
  EXPECT_EQ(refusal("digital_inputs = [\"box.coil\", \"box.coil\"]\nmist = \"box.coil\"\n"), "") << "readers";
}

}  // namespace
}  // namespace trn
