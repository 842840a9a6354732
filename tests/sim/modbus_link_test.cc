#include "hal/modbus/modbus_link.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/modbus/emulated_line.h"

// Requests on a line whose only device is unit 3, on a pseudo-terminal.
namespace trn {
namespace {

struct Bench {
  Bench() : line(address(), {3}), link(address(), 2) {}
  static ModbusAddress address() {
    return parse_modbus_address("rtu:" + testing::TempDir() + "link:115200:N");
  }
  EmulatedLine line;
  ModbusLink link;
  std::vector<std::uint16_t> values;
};

TEST(ModbusLink, ReadsAndWritesEveryTable) {
  Bench bench;
  for (const ModbusTable table : {ModbusTable::kInput, ModbusTable::kHolding}) {
    bench.line.set_block(3, table, 40, {11, 65535, 13});
    EXPECT_EQ(bench.link.read(3, table, 40, 3, bench.values), "");
    EXPECT_EQ(bench.values, (std::vector<std::uint16_t>{11, 65535, 13}));
  }
  for (const ModbusTable table : {ModbusTable::kCoil, ModbusTable::kDiscrete}) {
    bench.line.set_block(3, table, 8, {1, 0, 1});
    EXPECT_EQ(bench.link.read(3, table, 8, 3, bench.values), "");
    EXPECT_EQ(bench.values, (std::vector<std::uint16_t>{1, 0, 1}));
  }
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 40, {7}), "");
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 41, {8, 9}), "");
  EXPECT_EQ(bench.line.block(3, ModbusTable::kHolding, 40, 3), (std::vector<std::uint16_t>{7, 8, 9}));
  EXPECT_EQ(bench.link.write(3, ModbusTable::kCoil, 9, {5}), "");
  EXPECT_EQ(bench.line.get(3, ModbusTable::kCoil, 9), 1);
}

// After a refusal (exception 2: illegal data address) the line is as good as before.
TEST(ModbusLink, ARefusalSaysWhoWhatAndWhy) {
  Bench bench;
  bench.line.set(3, ModbusTable::kInput, 7, 5);
  const std::string who = Bench::address().text() + " unit 3: ", why = ": Illegal data address";
  EXPECT_EQ(bench.link.read(3, ModbusTable::kInput, 7, 2, bench.values), who + "reading input 7 to 8" + why);
  EXPECT_EQ(bench.link.write(3, ModbusTable::kHolding, 12, {1}), who + "writing holding 12" + why);
  EXPECT_EQ(bench.link.write(3, ModbusTable::kInput, 7, {1}),
            who + "only a coil or holding registers can be written");
  EXPECT_EQ(bench.link.read(3, ModbusTable::kInput, 7, 1, bench.values), "");
  EXPECT_EQ(bench.values, std::vector<std::uint16_t>{5});
}

}  // namespace
}  // namespace trn
