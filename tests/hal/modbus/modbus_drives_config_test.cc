#include <gtest/gtest.h>

#include <string>

#include "core/config.h"
#include "core/machine.h"
#include "hal/modbus/modbus_drives.h"
#include "hal/modbus/modbus_link.h"

// Section [drives] of type "modbus".
namespace trn {
namespace {

/// Two joints whose drives share a serial line of 38400 baud.
std::string refusal(double period_s, const std::string& axis_keys = "", const std::string& more = "") {
  std::string text = "[machine]\nname = \"m\"\nperiod_s = " + std::to_string(period_s) + "\n";
  for (const std::string name : {"Y", "Z"})
    text +=
        "[[joint]]\nname = \"" + name +
        "\"\ntype = \"linear\"\nmin_mm = -100\nmax_mm = 200\nvelocity_mm_s = 50\nacceleration_mm_s2 = 500\n"
        "jerk_mm_s3 = 5000\n";
  text +=
      "[drives]\ntype = \"modbus\"\n[[drives.line]]\nname = \"serial\"\naddress = "
      "\"rtu:/dev/ttyUSB0:38400\"\n";
  for (const std::string name : {"Y", "Z"})
    text += "[[drives.axis]]\njoint = \"" + name + "\"\nunit = " + (name == "Y" ? "1" : "2") +
            "\ncommand = 0\nanswer = 10\ncounts_per_mm = 1000\n" + (name == "Z" ? axis_keys : "");
  const Machine machine = read_machine(parse_config(text + more, "m.toml"));
  try {
    read_modbus_drives(machine, machine.root.table("drives"));
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

// Of an exchange: write 17 + 8 characters, read 8 + 13, four silences of 3.5; 60 characters of 11 bits at
// 19200 baud are 17.1875 ms, and the drive takes 5 ms twice. Two drives: 54.375 ms, of which a period may be
// 70
// %.
TEST(ModbusDrivesConfig, APeriodMustHoldTheExchanges) {
  EXPECT_EQ(refusal(0.078), "");
  EXPECT_NE(refusal(0.077), "");
  const std::string text = refusal(0.05);
  for (const char* part : {"line 'serial'", "a period of 50 ms, of which 70 %",
                           "serial unit 2 (joint Z): 17.2 ms on the line + 2 x 5 ms turnaround = 27.2 ms",
                           "together 54.4 ms of 35.0 ms", "machine.period_s = 0.078"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

// Four registers each from `command` (0) and `answer` (10) on, which may only meet in different tables.
TEST(ModbusDrivesConfig, WhatCannotBeIsRefused) {
  const auto says = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(refusal(0.1, "answer_table = \"holding\"\n"), "");
  const std::string again = "[[drives.axis]]\ncommand = 0\nanswer = 3\ncounts_per_mm = 1000\n";
  EXPECT_TRUE(says(refusal(0.1, "", again + "joint = \"Z\"\nunit = 3\n"),
                   "this joint has a drive already: serial unit 2 (joint Z)"));
  EXPECT_TRUE(says(refusal(0.1, "", again + "joint = \"Z\"\nunit = 3\nanswer_table = \"holding\"\n"),
                   "must not overlap"));
  EXPECT_TRUE(
      says(refusal(0.1, "", "[modbus]\n[[modbus.line]]\nname = \"b\"\naddress = \"rtu:/dev/ttyUSB0\"\n"),
           "is used by [[modbus.line]] 'b' already"));
}

TEST(ModbusDrivesConfig, AUnitIsTheFirstUnlessItIsSaid) {
  const Machine machine = read_machine(parse_config(R"([machine]
name = "m"
period_s = 0.1
[[joint]]
name = "Z"
type = "linear"
min_mm = -100
max_mm = 200
velocity_mm_s = 50
acceleration_mm_s2 = 500
jerk_mm_s3 = 5000
[drives]
type = "modbus"
[[drives.line]]
name = "net"
address = "tcp:indexer"
[[drives.axis]]
joint = "Z"
command = 0
answer = 0
counts_per_mm = 1000
)",
                                                    "m.toml"));
  const ModbusDrivesConfig config = read_modbus_drives(machine, machine.root.table("drives"));
  ASSERT_EQ(config.axes.size(), 1u);
  EXPECT_EQ(config.axes[0].unit, 1);
  EXPECT_EQ(config.axes[0].name, "net unit 1 (joint Z)");
  EXPECT_EQ(config.axes[0].answer_table, ModbusTable::kInput);
  EXPECT_EQ(config.axes[0].turnaround_s, 0.005);
  EXPECT_EQ(config.missed_max, 5u);
  EXPECT_NEAR(config.axes[0].axis.step_max, 40.01, 1e-12) << "5 + 3 periods at 50 mm/s, and ten counts";
}

// Four registers, of which the last one may be 65535.
TEST(ModbusDrivesConfig, RegistersEndWithTheirTable) {
  for (const std::string key : {"command", "answer"}) {
    const std::string axis = "[[drives.axis]]\njoint = \"Z\"\nunit = 2\ncounts_per_mm = 1000\n" +
                             std::string(key == "answer" ? "command" : "answer") + " = 0\n" + key + " = ";
    EXPECT_NE(refusal(0.1, "", axis + "65533\n").find("65532 is legal"), std::string::npos) << key;
    EXPECT_NE(refusal(0.1, "", axis + "65532\n").find("has a drive already"), std::string::npos) << key;
  }
}

TEST(ModbusDrivesConfig, AnExchangeTakesTheLinesTime) {
  ModbusAxisConfig axis;
  axis.turnaround_s = 0.005;
  EXPECT_NEAR(exchange_time_s(parse_modbus_address("rtu:/dev/x:19200:E"), axis), 0.034375 + 0.01, 1e-12);
  EXPECT_NEAR(exchange_time_s(parse_modbus_address("rtu:/dev/x:115200:E"), axis), 0.034375 / 6 + 0.01, 1e-12);
  EXPECT_NEAR(exchange_time_s(parse_modbus_address("tcp:cabinet"), axis), 0.01, 1e-12);
}

}  // namespace
}  // namespace trn
