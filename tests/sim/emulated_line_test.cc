#include "sim/modbus/emulated_line.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/modbus/modbus_link.h"

namespace trn {
namespace {

ModbusAddress address() { return parse_modbus_address("rtu:" + testing::TempDir() + "line:115200:N"); }

TEST(EmulatedLine, KeepsWhatItsUnitsAreTold) {
  EmulatedLine line(address(), {1, 7});
  line.set(1, ModbusTable::kHolding, 5, 11);
  line.set_block(7, ModbusTable::kHolding, 4, {21, 22, 23});
  EXPECT_EQ(line.get(1, ModbusTable::kHolding, 5), 11);
  EXPECT_EQ(line.get(7, ModbusTable::kHolding, 5), 22);
  EXPECT_EQ(line.block(7, ModbusTable::kHolding, 3, 5), (std::vector<std::uint16_t>{0, 21, 22, 23, 0}));
  EXPECT_EQ(line.get(1, ModbusTable::kInput, 5), 0) << "another table";
  EXPECT_EQ(line.get(2, ModbusTable::kHolding, 5), 0) << "no such unit";
}

TEST(EmulatedLine, ItsTerminalGoesWithIt) {
  const std::string link = address().device;
  {
    const EmulatedLine line(address(), {1});
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_TRUE(std::filesystem::is_character_file(link));
  }
  EXPECT_FALSE(std::filesystem::is_symlink(link));
  ModbusAddress nowhere = address();
  nowhere.device = testing::TempDir() + "no such folder/line";
  EXPECT_THROW(EmulatedLine(nowhere, {1}), std::runtime_error);
}

}  // namespace
}  // namespace trn
