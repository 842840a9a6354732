#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "hal/modbus/modbus_link.h"

namespace trn {

/// The server side of one Modbus device: four tables and the eight functions on them (Modbus application
/// protocol 1.1b3, clause 6). Pure: a request's PDU in, the answer's PDU out. Only addresses that were set
/// exist.
class EmulatedDevice {
 public:
  using Pdu = std::vector<std::uint8_t>;

  void set(ModbusTable table, int address, std::uint16_t value) { values_[{table, address}] = value; }
  /// 0 if there is no such address.
  std::uint16_t get(ModbusTable table, int address) const;
  /// Never empty; a refusal is the function with bit 7, and the exception code (clause 7).
  Pdu answer(std::span<const std::uint8_t> request);

 private:
  Pdu read_bits(std::span<const std::uint8_t> request, ModbusTable table) const;
  Pdu read_words(std::span<const std::uint8_t> request, ModbusTable table) const;
  Pdu write_one(std::span<const std::uint8_t> request, ModbusTable table);
  Pdu write_bits(std::span<const std::uint8_t> request);
  Pdu write_words(std::span<const std::uint8_t> request);
  bool has(ModbusTable table, int first, int count) const;

  std::map<std::pair<ModbusTable, int>, std::uint16_t> values_;
};

}  // namespace trn
