#include "sim/modbus/emulated_device.h"

namespace trn {

namespace {

enum Exception : std::uint8_t { kIllegalFunction = 1, kIllegalAddress = 2, kIllegalValue = 3 };

constexpr std::size_t kReadSize = 5, kWriteHead = 6;
// The most that one request may ask for by the Modbus application protocol.
constexpr int kBitsMax = 2000, kWordsMax = 125, kWriteBitsMax = 1968, kWriteWordsMax = 123;

int word_at(std::span<const std::uint8_t> bytes, std::size_t at) { return bytes[at] << 8 | bytes[at + 1]; }

void put_word(EmulatedDevice::Pdu& pdu, int value) {
  pdu.push_back(static_cast<std::uint8_t>(value >> 8));
  pdu.push_back(static_cast<std::uint8_t>(value));
}

EmulatedDevice::Pdu refuse(std::uint8_t function, Exception code) {
  // An exception answer has bit 7 of the function set (Modbus application protocol).
  return {static_cast<std::uint8_t>(function | 0x80u), code};
}

bool good_count(int count, int most) { return count >= 1 && count <= most; }

}  // namespace

std::uint16_t EmulatedDevice::get(ModbusTable table, int address) const {
  const auto found = values_.find({table, address});
  return found == values_.end() ? std::uint16_t{0} : found->second;
}

bool EmulatedDevice::has(ModbusTable table, int first, int count) const {
  for (int i = 0; i < count; ++i)
    if (!values_.contains({table, first + i})) return false;
  return true;
}

EmulatedDevice::Pdu EmulatedDevice::answer(std::span<const std::uint8_t> request) {
  if (request.empty()) return refuse(0, kIllegalFunction);
  switch (request[0]) {
    case 1:
      return read_bits(request, ModbusTable::kCoil);
    case 2:
      return read_bits(request, ModbusTable::kDiscrete);
    case 3:
      return read_words(request, ModbusTable::kHolding);
    case 4:
      return read_words(request, ModbusTable::kInput);
    case 5:
      return write_one(request, ModbusTable::kCoil);
    case 6:
      return write_one(request, ModbusTable::kHolding);
    case 15:
      return write_bits(request);
    case 16:
      return write_words(request);
    default:
      return refuse(request[0], kIllegalFunction);
  }
}

EmulatedDevice::Pdu EmulatedDevice::read_bits(std::span<const std::uint8_t> request,
                                              ModbusTable table) const {
  if (request.size() != kReadSize || !good_count(word_at(request, 3), kBitsMax))
    return refuse(request[0], kIllegalValue);
  const int first = word_at(request, 1), count = word_at(request, 3);
  // One address that does not exist refuses the whole request, as real devices do.
  if (!has(table, first, count)) return refuse(request[0], kIllegalAddress);
  Pdu out{request[0], static_cast<std::uint8_t>((count + 7) / 8)};
  out.resize(2 + static_cast<std::size_t>(out[1]), 0);
  for (int i = 0; i < count; ++i)
    if (get(table, first + i))
      out[static_cast<std::size_t>(2 + i / 8)] |= static_cast<std::uint8_t>(1u << i % 8);
  return out;
}

EmulatedDevice::Pdu EmulatedDevice::read_words(std::span<const std::uint8_t> request,
                                               ModbusTable table) const {
  if (request.size() != kReadSize || !good_count(word_at(request, 3), kWordsMax))
    return refuse(request[0], kIllegalValue);
  const int first = word_at(request, 1), count = word_at(request, 3);
  if (!has(table, first, count)) return refuse(request[0], kIllegalAddress);
  Pdu out{request[0], static_cast<std::uint8_t>(2 * count)};
  for (int i = 0; i < count; ++i) put_word(out, get(table, first + i));
  return out;
}

EmulatedDevice::Pdu EmulatedDevice::write_one(std::span<const std::uint8_t> request, ModbusTable table) {
  if (request.size() != kReadSize) return refuse(request[0], kIllegalValue);
  const int address = word_at(request, 1), value = word_at(request, 3);
  const bool coil = table == ModbusTable::kCoil;
  // A coil is written as 0 or 0xFF00, nothing else is legal.
  if (coil && value != 0 && value != 0xFF00) return refuse(request[0], kIllegalValue);
  if (!has(table, address, 1)) return refuse(request[0], kIllegalAddress);
  set(table, address, static_cast<std::uint16_t>(coil ? value != 0 : value));
  return {request.begin(), request.end()};
}

EmulatedDevice::Pdu EmulatedDevice::write_bits(std::span<const std::uint8_t> request) {
  const bool head = request.size() > kWriteHead;
  const int count = head ? word_at(request, 3) : 0;
  const auto bytes = static_cast<std::size_t>((count + 7) / 8);
  if (!head || !good_count(count, kWriteBitsMax) || request[5] != bytes ||
      request.size() != kWriteHead + bytes)
    return refuse(request[0], kIllegalValue);
  const int first = word_at(request, 1);
  if (!has(ModbusTable::kCoil, first, count)) return refuse(request[0], kIllegalAddress);
  for (int i = 0; i < count; ++i)
    set(ModbusTable::kCoil, first + i, request[kWriteHead + static_cast<std::size_t>(i / 8)] >> i % 8 & 1u);
  return {request.begin(), request.begin() + kReadSize};
}

EmulatedDevice::Pdu EmulatedDevice::write_words(std::span<const std::uint8_t> request) {
  const bool head = request.size() > kWriteHead;
  const int count = head ? word_at(request, 3) : 0;
  const auto bytes = static_cast<std::size_t>(2 * count);
  if (!head || !good_count(count, kWriteWordsMax) || request[5] != bytes ||
      request.size() != kWriteHead + bytes)
    return refuse(request[0], kIllegalValue);
  const int first = word_at(request, 1);
  if (!has(ModbusTable::kHolding, first, count)) return refuse(request[0], kIllegalAddress);
  for (int i = 0; i < count; ++i)
    set(ModbusTable::kHolding, first + i,
        static_cast<std::uint16_t>(word_at(request, kWriteHead + 2 * static_cast<std::size_t>(i))));
  return {request.begin(), request.begin() + kReadSize};
}

}  // namespace trn
