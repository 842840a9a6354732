#include "sim/modbus/modbus_framing.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

namespace {

constexpr std::size_t kMbapSize = 7, kMbapLengthMax = 254;

/// Bytes of a serial request, by its function: fixed, or with a byte count. 0: not yet known; nothing: no
/// request of ours.
std::optional<std::size_t> rtu_request_size(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kFixed = 8, kCountAt = 6, kAround = 9;
  if (bytes.size() < 2) return 0;
  if (bytes[1] >= 1 && bytes[1] <= 6) return kFixed;
  if (bytes[1] != 15 && bytes[1] != 16) return std::nullopt;
  return bytes.size() <= kCountAt ? 0 : kAround + bytes[kCountAt];
}

}  // namespace

std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = static_cast<std::uint16_t>(crc & 1 ? crc >> 1 ^ 0xA001 : crc >> 1);
  }
  return crc;
}

std::optional<ModbusRequest> take_tcp_request(std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kMbapSize) return std::nullopt;
  const std::size_t length = static_cast<std::size_t>(bytes[4]) << 8 | bytes[5];
  if (bytes[2] != 0 || bytes[3] != 0 || length < 2 || length > kMbapLengthMax) {
    // Not a Modbus header (protocol number 0, a length that a request can have): where the next begins cannot
    // be known.
    bytes.clear();
    return std::nullopt;
  }
  // The header's length counts from the unit on, which is the header's own last byte.
  const std::size_t size = kMbapSize - 1 + length;
  if (bytes.size() < size) return std::nullopt;
  ModbusRequest request{static_cast<std::uint16_t>(bytes[0] << 8 | bytes[1]), bytes[6], {}};
  const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(size);
  TRN_CHECK(size > kMbapSize - 1);
  request.pdu.assign(bytes.begin() + kMbapSize, end);
  bytes.erase(bytes.begin(), end);
  return request;
}

std::optional<ModbusRequest> take_rtu_request(std::vector<std::uint8_t>& bytes) {
  while (!bytes.empty()) {
    const auto size = rtu_request_size(bytes);
    if (size && (*size == 0 || bytes.size() < *size)) return std::nullopt;
    // The checksum over a frame with its own checksum is 0, whatever the frame.
    if (size && modbus_crc({bytes.data(), *size}) == 0) {
      const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(*size);
      ModbusRequest request{0, bytes[0], {bytes.begin() + 1, end - 2}};
      bytes.erase(bytes.begin(), end);
      return request;
    }
    // No request begins here. The next byte is tried, so that a line with noise on it finds its way back by
    // itself.
    bytes.erase(bytes.begin());
  }
  return std::nullopt;
}

std::vector<std::uint8_t> tcp_answer(const ModbusRequest& request, std::span<const std::uint8_t> pdu) {
  const std::size_t length = pdu.size() + 1;
  std::vector<std::uint8_t> out(kMbapSize + pdu.size());
  out[0] = static_cast<std::uint8_t>(request.transaction >> 8);
  out[1] = static_cast<std::uint8_t>(request.transaction);
  out[4] = static_cast<std::uint8_t>(length >> 8);
  out[5] = static_cast<std::uint8_t>(length);
  out[6] = static_cast<std::uint8_t>(request.unit);
  std::copy(pdu.begin(), pdu.end(), out.begin() + kMbapSize);
  return out;
}

std::vector<std::uint8_t> rtu_answer(const ModbusRequest& request, std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> out(pdu.size() + 3);
  out[0] = static_cast<std::uint8_t>(request.unit);
  std::copy(pdu.begin(), pdu.end(), out.begin() + 1);
  const std::uint16_t crc = modbus_crc({out.data(), pdu.size() + 1});
  // On the serial line the checksum goes low byte first, all other words high byte first.
  out[pdu.size() + 1] = static_cast<std::uint8_t>(crc);
  out[pdu.size() + 2] = static_cast<std::uint8_t>(crc >> 8);
  return out;
}

}  // namespace trn
