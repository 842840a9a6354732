#include "sim/modbus/emulated_cabinet.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "core/config.h"
#include "hal/modbus/modbus_io.h"
#include "hal/modbus/modbus_link.h"

namespace trn {
namespace {

// An inverter and a box of four inputs and outputs, on a pseudo-terminal.
ConfigTable config(const std::string& io, const std::string& more = "") {
  std::string text = "[modbus]\n[[modbus.line]]\nname = \"a\"\naddress = \"rtu:" + testing::TempDir() +
                     "cabinet:115200:N\"\n";
  const auto value = [&](const std::string& name, const std::string& table, int address,
                         const std::string& keys) {
    text += "[[modbus.device.value]]\nname = \"" + name + "\"\ntable = \"" + table +
            "\"\naddress = " + std::to_string(address) + "\n" + keys;
  };
  text += "[[modbus.device]]\nname = \"inverter\"\nline = \"a\"\nunit = 1\n";
  value("speed", "holding", 0, "");
  value("run", "coil", 0, "");
  value("actual", "input", 0, "");
  value("at_speed", "discrete", 0, "");
  text += "[[modbus.device]]\nname = \"box\"\nline = \"a\"\nunit = 2\n";
  for (int i = 0; i < 4; ++i) value("in" + std::to_string(i), "discrete", i, "");
  for (int i = 0; i < 4; ++i) value("out" + std::to_string(i), "coil", i, "");
  value("celsius", "input", 7, "signed = true\nscale = 0.5\n");
  return parse_config(text + more + "[io]\ntype = \"modbus\"\n" + io, "cabinet.toml");
}

constexpr char kSpindle[] = R"([io.spindle]
speed = "inverter.speed"
run = "inverter.run"
actual = "inverter.actual"
at_speed = "inverter.at_speed"
)";

// Input i follows output i as far as there are both.
TEST(EmulatedCabinet, InputsFollowOutputsOfTheSameNumber) {
  const std::string two = R"(["box.in0", "box.in1"])",
                    four = R"(["box.in0", "box.in1", "box.in2", "box.in3"])";
  const std::string three_out = R"(["box.out0", "box.out1", "box.out2"])";
  for (const std::string& inputs : {two, four}) {
    const ConfigTable root = config("digital_inputs = " + inputs + "\ndigital_outputs = " + three_out + "\n");
    EmulatedCabinet cabinet(read_modbus_io(root), {});
    for (const char* name : {"box.out0", "box.out2", "box.in3"}) cabinet.set(name, 1);
    cabinet.step(0.01);
    EXPECT_EQ(cabinet.get("box.in0"), 1);
    EXPECT_EQ(cabinet.get("box.in1"), 0);
    EXPECT_EQ(cabinet.get("box.in2"), inputs == four ? 1 : 0);
    EXPECT_EQ(cabinet.get("box.in3"), 1) << "no output is there: it stays";
    cabinet.set("box.out0", 0);
    cabinet.step(0.01);
    EXPECT_EQ(cabinet.get("box.in0"), 0);
  }
}

// The inverter's ramp: 12000 rpm/s.
TEST(EmulatedCabinet, TheSpindleTakesItsTime) {
  const ConfigTable root = config(kSpindle);
  EmulatedCabinet cabinet(read_modbus_io(root), {});
  cabinet.set("inverter.speed", 6000);
  cabinet.step(0.1);
  EXPECT_EQ(cabinet.get("inverter.actual"), 0) << "it is not told to run";
  cabinet.set("inverter.run", 1);
  for (int i = 1; i <= 5; ++i) {
    EXPECT_EQ(cabinet.get("inverter.at_speed"), i == 1 ? 1 : 0) << "stands as told, then turns too slowly";
    cabinet.step(0.1);
    EXPECT_NEAR(cabinet.get("inverter.actual"), 1200 * i, 1);
  }
  EXPECT_EQ(cabinet.get("inverter.at_speed"), 1);
  cabinet.set("inverter.run", 0);
  cabinet.step(0.2);
  EXPECT_NEAR(cabinet.get("inverter.actual"), 3600, 1);
}

TEST(EmulatedCabinet, OtherValuesRunByThemselves) {
  const ConfigTable root =
      config("", "[[modbus.emulation]]\nvalue = \"box.celsius\"\nstart = 20\nrate_per_s = -3\n");
  const ModbusIoConfig io = read_modbus_io(root);
  EmulatedCabinet cabinet(io, read_emulated_values(root, io.devices));
  EXPECT_EQ(cabinet.get("box.celsius"), 20);
  for (int i = 0; i < 10; ++i) cabinet.step(1);
  EXPECT_EQ(cabinet.get("box.celsius"), -10);
  EXPECT_EQ(cabinet.line(0).get(2, ModbusTable::kInput, 7), 65536 - 20) << "halves of a degree";
  EXPECT_THROW(cabinet.set("box.kelvin", 1), std::runtime_error);
  EXPECT_THROW(cabinet.trouble("boxes", {}), std::runtime_error);
}

}  // namespace
}  // namespace trn
