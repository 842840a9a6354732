#include "sim/modbus/emulated_device.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "hal/modbus/modbus_link.h"

// Examples of the Modbus application protocol 1.1b3, clause 6, whose numbers of coils and registers count
// from 1.
namespace trn {
namespace {

using Pdu = EmulatedDevice::Pdu;

/// `bits` as printed there: the first one last in each byte.
void set_bits(EmulatedDevice& device, ModbusTable table, int first, const std::vector<std::string>& bytes) {
  for (const std::string& byte : bytes)
    for (auto bit = byte.rbegin(); bit != byte.rend(); ++bit) device.set(table, first++, *bit == '1' ? 1 : 0);
}

TEST(EmulatedDevice, ReadsAsTheStandardDoes) {
  EmulatedDevice device;
  set_bits(device, ModbusTable::kCoil, 19, {"11001101", "01101011", "101"});
  EXPECT_EQ(device.answer(Pdu{1, 0x00, 0x13, 0x00, 0x13}), (Pdu{1, 3, 0xCD, 0x6B, 0x05}));
  set_bits(device, ModbusTable::kDiscrete, 196, {"10101100", "11011011", "110101"});
  EXPECT_EQ(device.answer(Pdu{2, 0x00, 0xC4, 0x00, 0x16}), (Pdu{2, 3, 0xAC, 0xDB, 0x35}));
  device.set(ModbusTable::kHolding, 107, 0x022B);
  device.set(ModbusTable::kHolding, 108, 0);
  device.set(ModbusTable::kHolding, 109, 0x0064);
  EXPECT_EQ(device.answer(Pdu{3, 0x00, 0x6B, 0x00, 0x03}), (Pdu{3, 6, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64}));
  device.set(ModbusTable::kInput, 8, 10);
  EXPECT_EQ(device.answer(Pdu{4, 0x00, 0x08, 0x00, 0x01}), (Pdu{4, 2, 0x00, 0x0A}));
}

TEST(EmulatedDevice, WritesAsTheStandardDoes) {
  EmulatedDevice device;
  set_bits(device, ModbusTable::kCoil, 19, {"00000000", "00"});
  device.set(ModbusTable::kCoil, 172, 0);
  device.set(ModbusTable::kHolding, 1, 0);
  device.set(ModbusTable::kHolding, 2, 0);
  EXPECT_EQ(device.answer(Pdu{5, 0x00, 0xAC, 0xFF, 0x00}), (Pdu{5, 0x00, 0xAC, 0xFF, 0x00}));
  EXPECT_EQ(device.get(ModbusTable::kCoil, 172), 1);
  EXPECT_EQ(device.answer(Pdu{5, 0x00, 0xAC, 0x00, 0x00}), (Pdu{5, 0x00, 0xAC, 0x00, 0x00}));
  EXPECT_EQ(device.get(ModbusTable::kCoil, 172), 0);
  EXPECT_EQ(device.answer(Pdu{6, 0x00, 0x01, 0x00, 0x03}), (Pdu{6, 0x00, 0x01, 0x00, 0x03}));
  EXPECT_EQ(device.get(ModbusTable::kHolding, 1), 3);
  EXPECT_EQ(device.answer(Pdu{15, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01}),
            (Pdu{15, 0x00, 0x13, 0x00, 0x0A}));
  for (int i = 0; i < 10; ++i) EXPECT_EQ(device.get(ModbusTable::kCoil, 19 + i), 0x1CD >> i & 1) << i;
  EXPECT_EQ(device.answer(Pdu{16, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02}),
            (Pdu{16, 0x00, 0x01, 0x00, 0x02}));
  EXPECT_EQ(device.get(ModbusTable::kHolding, 1), 0x000A);
  EXPECT_EQ(device.get(ModbusTable::kHolding, 2), 0x0102);
}

// Clause 7: 1 illegal function, 2 illegal address, 3 illegal value.
TEST(EmulatedDevice, RefusesWithTheCodeOfTheStandard) {
  EmulatedDevice device;
  for (int i = 0; i < 2100; ++i) {
    device.set(ModbusTable::kCoil, i, 0);
    device.set(ModbusTable::kHolding, i, 0);
  }
  const auto refused = [&](const Pdu& request, std::uint8_t code) {
    return device.answer(request) == Pdu{static_cast<std::uint8_t>(request[0] | 0x80), code};
  };
  EXPECT_TRUE(refused({7}, 1));
  EXPECT_TRUE(refused({3, 0x08, 0x33, 0, 2}, 2)) << "2099 and 2100";
  EXPECT_TRUE(refused({2, 0, 0, 0, 1}, 2));
  EXPECT_TRUE(refused({6, 0x08, 0x34, 0, 1}, 2));
  EXPECT_TRUE(refused({5, 0x08, 0x34, 0xFF, 0}, 2));
  EXPECT_TRUE(refused({15, 0x08, 0x33, 0, 2, 1, 3}, 2));
  EXPECT_TRUE(refused({16, 0x08, 0x33, 0, 2, 4, 0, 1, 0, 2}, 2));
  EXPECT_TRUE(refused({3, 0, 0, 0, 0}, 3)) << "none";
  EXPECT_TRUE(refused({3, 0, 0, 0, 126}, 3)) << "125 registers are the most";
  EXPECT_EQ(device.answer(Pdu{3, 0, 0, 0, 125}).size(), 252u);
  EXPECT_TRUE(refused({1, 0, 0, 0x07, 0xD1}, 3)) << "2000 coils are the most";
  EXPECT_EQ(device.answer(Pdu{1, 0, 0, 0x07, 0xD0}).size(), 252u);
  EXPECT_TRUE(refused({5, 0, 0, 0x01, 0x00}, 3)) << "neither on nor off";
  EXPECT_TRUE(refused({3, 0, 0, 0}, 3)) << "cut";
  EXPECT_TRUE(refused({3, 0, 0, 0, 1, 0}, 3)) << "too long";
  EXPECT_TRUE(refused({16, 0, 1, 0, 2, 4, 0, 1, 0}, 3)) << "cut";
  EXPECT_TRUE(refused({16, 0, 1, 0, 2, 3, 0, 1, 0, 2}, 3)) << "miscounted";
  EXPECT_TRUE(refused({15, 0, 1, 0, 9, 1, 0xFF}, 3)) << "nine coils need two bytes";
  Pdu most{16, 0, 0, 0, 123, 246};
  most.resize(6 + 246);
  EXPECT_EQ(device.answer(most), (Pdu{16, 0, 0, 0, 123}));
  most[4] = 124;
  most[5] = 248;
  most.resize(6 + 248);
  EXPECT_TRUE(refused(most, 3));
}

}  // namespace
}  // namespace trn
