#include "hal/modbus/modbus_io.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/ports.h"
#include "sim/modbus/emulated_cabinet.h"
#include "tests/support/paths.h"

// The machine's inputs and outputs on Modbus: the tick's side against an emulated cabinet on loopback TCP and
// a pseudo-terminal.
namespace trn {
namespace {

std::string edited_config(int port) {
  std::ifstream in(source_dir() + "/configs/mill_modbus.toml");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto replace = [&](const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  };
  replace("127.0.0.1:1502", "127.0.0.1:" + std::to_string(port));
  replace("/dev/ttyUSB0:19200:E", testing::TempDir() + "trunnion_cabinet:19200:N");
  return text;
}

class Cabinet : public testing::Test {
 protected:
  explicit Cabinet(const std::function<void(ModbusIoConfig&)>& edit = [](ModbusIoConfig&) {}) {
    for (int port = 15120; !cabinet && port < 15170; ++port) {
      const ConfigTable root = parse_config(edited_config(port), "mill_modbus.toml");
      config = read_modbus_io(root);
      edit(config);
      try {
        cabinet = std::make_unique<EmulatedCabinet>(config, read_emulated_values(root, config.devices));
      } catch (const std::runtime_error&) {
      }
    }
    io = std::make_unique<ModbusIo>(config, [this](const std::string& name, double value) {
      if (name == "thermo.x_nut") x_nut = value;
    });
    io->bring_up();
  }
  bool until(const std::function<bool()>& done, double limit_s = 10) {
    for (int i = 0; i < limit_s * 200; ++i) {
      io->exchange(outputs, {q, offset}, inputs);
      if (done()) return true;
      cabinet->step(0.005);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  ModbusIoConfig config;
  std::unique_ptr<EmulatedCabinet> cabinet;
  std::atomic<double> x_nut = -1000;
  std::unique_ptr<ModbusIo> io;
  IoOutputs outputs;
  IoInputs inputs;
  JointVec q;
  Vec3 offset = Vec3::Zero();
};

class PlainCabinet : public Cabinet {
 protected:
  PlainCabinet() : Cabinet([](ModbusIoConfig& own) { own.spindle.fault.clear(); }) {}
};

class AnalogCabinet : public Cabinet {
 protected:
  AnalogCabinet()
      : Cabinet([](ModbusIoConfig& own) {
          own.digital_outputs.clear();
          own.analog_outputs = {"box.vacuum"};
        }) {}
};

class OnePumpCabinet : public Cabinet {
 protected:
  OnePumpCabinet() : Cabinet([](ModbusIoConfig& own) { own.mist = own.flood; }) {}
};

// M7 off and M8 on once switched the pump's coil off and on at every turn.
TEST_F(OnePumpCabinet, APumpForBothRunsWhileOneIsOn) {
  for (const int coolant : {2, 1, 3}) {
    outputs.coolant = coolant;
    ASSERT_TRUE(until([&] { return cabinet->get("box.flood") == 1; })) << coolant;
    EXPECT_FALSE(until([&] { return cabinet->get("box.flood") == 0; }, 0.3)) << coolant;
    outputs.coolant = 0;
    ASSERT_TRUE(until([&] { return cabinet->get("box.flood") == 0; })) << coolant;
  }
}

TEST_F(AnalogCabinet, TheFirstAnalogOutputIsSent) {
  outputs.analog[0] = 1;
  EXPECT_TRUE(until([&] { return cabinet->get("box.vacuum") == 1; })) << io->explain_fault();
  outputs.analog[0] = 0;
  EXPECT_TRUE(until([&] { return cabinet->get("box.vacuum") == 0; })) << io->explain_fault();
}

// No program can ask for less while it is a fault, so a reset must end it.
TEST_F(AnalogCabinet, AResetGivesUpWhatDidNotFit) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; })) << io->explain_fault();
  outputs.analog[0] = 70000;
  ASSERT_TRUE(until([&] { return inputs.fault == Fault::kDeviceFault; }));
  EXPECT_FALSE(until([&] { return inputs.fault == Fault::kOk; }, 0.3)) << "it stays until then";
  io->bring_up();
  EXPECT_TRUE(until([&] { return inputs.fault == Fault::kOk; })) << io->explain_fault();
  EXPECT_EQ(cabinet->get("box.vacuum"), 0);
  outputs.analog[0] = 1;
  EXPECT_TRUE(until([&] { return cabinet->get("box.vacuum") == 1; })) << io->explain_fault();
}

TEST_F(PlainCabinet, AnInverterThatTellsNoFaultHasNone) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; })) << io->explain_fault();
  EXPECT_EQ(inputs.fault, Fault::kOk);
  EXPECT_EQ(io->explain_fault(), "");
}

TEST_F(Cabinet, SpindleIsReadyOnlyWhenItTurnsAsTold) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; })) << io->explain_fault();
  outputs.spindle_rpm = 6000;
  io->exchange(outputs, {q, offset}, inputs);
  EXPECT_FALSE(inputs.spindle_ready) << "in the very period of the command";
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; })) << io->explain_fault();
  EXPECT_EQ(cabinet->get("inverter.run"), 1);
  EXPECT_NEAR(cabinet->get("inverter.actual"), 6000, 51);
  outputs.spindle_rpm = -3000;
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; }));
  EXPECT_EQ(cabinet->get("inverter.reverse"), 1);
  EXPECT_EQ(cabinet->get("inverter.speed"), 3000);
  outputs.spindle_rpm = 0;
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; }));
  EXPECT_EQ(cabinet->get("inverter.run"), 0);
  EXPECT_LT(cabinet->get("inverter.actual"), 51);
}

// 70000 rpm do not fit sixteen bits. Told to run, the inverter would start at the speed of before.
TEST_F(Cabinet, ASpindleDoesNotStartAtASpeedThatDoesNotFit) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; })) << io->explain_fault();
  outputs.spindle_rpm = -70000;
  ASSERT_TRUE(until([&] { return inputs.fault == Fault::kDeviceFault; }));
  EXPECT_NE(io->explain_fault().find("inverter.speed = 70000 does not fit register 0 (0 to 65535)"),
            std::string::npos)
      << io->explain_fault();
  EXPECT_FALSE(until([&] { return inputs.spindle_ready; }, 0.5));
  for (const char* name : {"inverter.run", "inverter.reverse", "inverter.speed"})
    EXPECT_EQ(cabinet->get(name), 0) << name;
  outputs.spindle_rpm = 6000;
  EXPECT_TRUE(until([&] { return inputs.spindle_ready && inputs.fault == Fault::kOk; }))
      << io->explain_fault();
  EXPECT_EQ(cabinet->get("inverter.speed"), 6000);
}

TEST_F(Cabinet, OutputsComeBackAsInputsAndTemperaturesAreTold) {
  outputs.digital = 1;
  outputs.coolant = 2;
  ASSERT_TRUE(until([&] { return (inputs.digital & 1) != 0; })) << io->explain_fault();
  ASSERT_TRUE(until([&] { return cabinet->get("box.flood") == 1; }));
  outputs.digital = 0;
  ASSERT_TRUE(until([&] { return (inputs.digital & 1) == 0; }));
  ASSERT_TRUE(until([&] { return x_nut > 0; })) << io->explain_fault();
  EXPECT_NEAR(x_nut, 20, 2);
}

TEST_F(Cabinet, AnInverterInFaultIsAFaultUntilItIsWell) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; }));
  cabinet->set("inverter.fault", 7);
  ASSERT_TRUE(until([&] { return inputs.fault == Fault::kDeviceFault; }));
  EXPECT_NE(io->explain_fault().find("fault 7"), std::string::npos) << io->explain_fault();
  cabinet->set("inverter.fault", 0);
  EXPECT_TRUE(until([&] { return inputs.fault == Fault::kOk; }));
}

TEST_F(Cabinet, ALostBoxIsAFaultALostThermometerIsNot) {
  ASSERT_TRUE(until([&] { return inputs.spindle_ready; }));
  cabinet->trouble("thermo", {true, false, 0, 0});
  EXPECT_FALSE(until([&] { return inputs.fault != Fault::kOk; }, 1)) << io->explain_fault();
  cabinet->trouble("box", {true, false, 0, 0});
  ASSERT_TRUE(until([&] { return inputs.fault == Fault::kDeviceLost; }));
  EXPECT_NE(io->explain_fault().find("box"), std::string::npos) << io->explain_fault();
  cabinet->trouble("box", {});
  EXPECT_TRUE(until([&] { return inputs.fault == Fault::kOk; }));
}

TEST_F(Cabinet, EverythingIsOffAtTheEnd) {
  outputs.spindle_rpm = 6000;
  outputs.digital = 1;
  ASSERT_TRUE(until([&] { return cabinet->get("box.vacuum") == 1 && cabinet->get("inverter.run") == 1; }));
  io->shut_down();
  EXPECT_EQ(cabinet->get("box.vacuum"), 0);
  EXPECT_EQ(cabinet->get("inverter.run"), 0);
}

TEST(ModbusIoConfig, ARoleNeedsAValueThatExistsAndCanBeWritten) {
  const auto error_of = [](const std::string& from, const std::string& to) {
    std::string text = edited_config(1502);
    text.replace(text.find(from), from.size(), to);
    try {
      read_modbus_io(parse_config(text, "x.toml"));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of("speed = \"inverter.speed\"", "speed = \"inverter.speed\""), "");
  EXPECT_NE(error_of("speed = \"inverter.speed\"", "speed = \"inverter.sped\"").find("inverter.speed"),
            std::string::npos);
  EXPECT_NE(error_of("run = \"inverter.run\"", "run = \"inverter.at_speed\"").find("cannot be written"),
            std::string::npos);
  EXPECT_NE(error_of("[\"box.vacuum\"]", "[\"box.vacum\"]").find("did you mean 'box.vacuum'"),
            std::string::npos);
}

// An inverter that takes its orders in registers: its run word is 1 or 0.
TEST(ModbusIo, AnInverterOfRegistersIsToldOneToRun) {
  const std::string value = "[[modbus.device.value]]\ntable = \"holding\"\n";
  const ConfigTable root = parse_config(
      "[modbus]\n[[modbus.line]]\nname = \"a\"\naddress = \"rtu:" + testing::TempDir() +
          "inverter:115200:N\"\n[[modbus.device]]\nname = \"i\"\npoll_s = 0.02\n" + value +
          "name = \"speed\"\naddress = 0\nsigned = true\n" + value + "name = \"run\"\naddress = 1\n" +
          "[io]\ntype = \"modbus\"\n[io.spindle]\nspeed = \"i.speed\"\nrun = \"i.run\"\n",
      "m.toml");
  const ModbusIoConfig config = read_modbus_io(root);
  EmulatedCabinet cabinet(config, {});
  ModbusIo io(config, {});
  io.bring_up();
  IoOutputs outputs;
  IoInputs inputs;
  const JointVec q;
  const Vec3 offset = Vec3::Zero();
  for (const double rpm : {-900.0, 0.0, 700.0}) {
    outputs.spindle_rpm = rpm;
    for (int i = 0; i < 2000 && cabinet.get("i.speed") != rpm; ++i) {
      io.exchange(outputs, {q, offset}, inputs);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_EQ(cabinet.get("i.speed"), rpm) << "with its sign: nothing else says which way";
    for (int i = 0; i < 2000 && cabinet.get("i.run") != (rpm != 0 ? 1 : 0); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(cabinet.get("i.run"), rpm != 0 ? 1 : 0);
  }
}

}  // namespace
}  // namespace trn
