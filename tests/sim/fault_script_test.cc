#include "sim/canopen/fault_script.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/config.h"
#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/modbus/modbus_link.h"
#include "sim/canopen/emulated_node.h"
#include "sim/modbus/emulated_cabinet.h"
#include "sim/modbus/emulated_line.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

using Trouble = EmulatedNode::Trouble;

FaultScript read(const std::string& text) { return read_fault_script(parse_config(text, "faults.toml")); }

TEST(FaultScript, EveryKindHasItsName) {
  const std::pair<std::string, Trouble> rows[] = {{"silent", Trouble::kSilent},
                                                  {"reset", Trouble::kReset},
                                                  {"emergency", Trouble::kEmergency},
                                                  {"fault", Trouble::kFault},
                                                  {"no_heartbeat", Trouble::kNoHeartbeat},
                                                  {"heartbeat_late", Trouble::kHeartbeatLate},
                                                  {"drop", Trouble::kDrop},
                                                  {"duplicate", Trouble::kDuplicate},
                                                  {"reorder", Trouble::kReorder},
                                                  {"short_pdo", Trouble::kShortPdo},
                                                  {"refuse", Trouble::kRefuse},
                                                  {"slow", Trouble::kSlow},
                                                  {"lie", Trouble::kLie},
                                                  {"pre_operational", Trouble::kPreOperational},
                                                  {"ignore", Trouble::kIgnore},
                                                  {"quiet_fault", Trouble::kQuietFault},
                                                  {"held", Trouble::kHeld},
                                                  {"sto", Trouble::kSto},
                                                  {"inputs", Trouble::kInputs}};
  for (const auto& [name, kind] : rows) {
    const FaultScript script = read("[[fault]]\nat_s = 2.5\nnode = 7\nkind = \"" + name + "\"\n");
    ASSERT_EQ(script.events.size(), 1u);
    EXPECT_EQ(script.events[0].kind, kind) << name;
    EXPECT_EQ(script.events[0].at_s, 2.5);
    EXPECT_EQ(script.events[0].node, 7);
    EXPECT_EQ(script.events[0].bus, 0u);
    EXPECT_EQ(script.events[0].value, 1);
  }
}

TEST(FaultScript, DevicesHaveTheirOwnTroubles) {
  const auto trouble = [](const std::string& kind, int value) {
    const FaultScript script = read("[[fault]]\nat_s = 0\ndevice = \"box\"\nkind = \"" + kind +
                                    "\"\nvalue = " + std::to_string(value) + "\n");
    EXPECT_TRUE(script.events.empty());
    EXPECT_EQ(script.device_events.at(0).device, "box");
    return script.device_events.at(0).trouble;
  };
  EXPECT_TRUE(trouble("silent", 1).silent);
  EXPECT_TRUE(trouble("short", 1).is_short);
  EXPECT_EQ(trouble("slow", 40).late_ms, 40);
  EXPECT_EQ(trouble("slow", -1).late_ms, 0);
  EXPECT_EQ(trouble("lie", -9).lie, -9);
  const EmulatedLine::Trouble good = trouble("good", 5);
  EXPECT_TRUE(!good.silent && !good.is_short && good.late_ms == 0 && good.lie == 0);
}

TEST(FaultScript, WhatCannotBeIsRefused) {
  const std::string event = "[[fault]]\nat_s = 0\n";
  for (const char* bad : {"node = 0\nkind = \"reset\"\n", "node = 128\nkind = \"reset\"\n",
                          "kind = \"reset\"\n", "node = 1\nkind = \"resets\"\n",
                          "node = 1\nbus = 8\nkind = \"reset\"\n", "node = 1\nkind = \"reset\"\nwhen = 3\n"})
    EXPECT_THROW(read(event + bad), ConfigError) << bad;
  EXPECT_THROW(read("[[fault]]\nat_s = -1\nnode = 1\nkind = \"reset\"\n"), ConfigError);
  EXPECT_TRUE(read("").events.empty());
}

// A node that boots says so once: reset when its time has come, on its bus, and not again.
TEST(FaultScript, WhatIsDueHappensOnceAndToItsNode) {
  std::vector<std::unique_ptr<EmulatedNode>> nodes;
  for (const int id : {3, 4}) {
    EmulatedNode::Config config;
    config.id = id;
    config.dictionary = load_eds(source_dir() + "/configs/eds/servo.eds", id);
    config.drive.joint.servo = {250, 0.7, 1, 0.001};
    nodes.push_back(std::make_unique<EmulatedNode>(config));
  }
  FaultScript script = read(
      "[[fault]]\nat_s = 0.5\nnode = 4\nkind = \"reset\"\n[[fault]]\nat_s = 0.1\nbus = 1\nnode = 3\nkind = "
      "\"reset\"\n");
  const auto booted = [&](std::size_t bus, std::int64_t time_ns) {
    script.run(nodes, bus, time_ns, 1'000'000'000 + time_ns);
    std::vector<int> out;
    CanFrame frame;
    for (const auto& node : nodes)
      while (node->next_frame(INT64_MAX, frame)) out.push_back(node->id());
    return out;
  };
  EXPECT_EQ(booted(0, 499'999'999), std::vector<int>{});
  EXPECT_EQ(booted(0, 500'000'000), std::vector<int>{4});
  EXPECT_EQ(booted(0, 600'000'000), std::vector<int>{});
  EXPECT_EQ(booted(1, 600'000'000), std::vector<int>{3});
}

// A device that is unplugged at half a second, and plugged in again by hand, stays so.
TEST(FaultScript, ADevicesTroubleIsDueOnce) {
  const std::string address = "rtu:" + testing::TempDir() + "script:115200:N";
  const ConfigTable root = parse_config("[modbus]\n[[modbus.line]]\nname = \"a\"\naddress = \"" + address +
                                            "\"\n[[modbus.device]]\nname = \"box\"\n[[modbus.device.value]]\n"
                                            "name = \"v\"\ntable = \"input\"\naddress = 0\n"
                                            "[io]\ntype = \"modbus\"\n",
                                        "m.toml");
  EmulatedCabinet cabinet(read_modbus_io(root), {});
  FaultScript script = read("[[fault]]\nat_s = 0.5\ndevice = \"box\"\nkind = \"silent\"\n");
  const auto answers = [&](std::int64_t time_ns, double timeout_s) {
    script.run(cabinet, time_ns);
    ModbusLink link(parse_modbus_address(address), timeout_s);
    std::vector<std::uint16_t> values;
    return link.read(1, ModbusTable::kInput, 0, 1, values).empty();
  };
  EXPECT_TRUE(answers(499'999'999, 5));
  EXPECT_FALSE(answers(500'000'000, 0.2));
  cabinet.trouble("box", {});
  EXPECT_TRUE(answers(600'000'000, 5));
}

}  // namespace
}  // namespace trn
