#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trn {

/// How a PDU travels: behind an MBAP header on TCP (Modbus messaging on TCP/IP 1.0b, 3.1.3), or between unit
/// and CRC on a serial line (Modbus over serial line 1.02, 2.5.1).
struct ModbusRequest {
  std::uint16_t transaction = 0;  ///< TCP
  int unit = 0;
  std::vector<std::uint8_t> pdu;
};

/// Takes the first whole request out of what has come; nothing if there is none yet. Bytes that cannot be a
/// request are dropped.
std::optional<ModbusRequest> take_tcp_request(std::vector<std::uint8_t>& bytes);
std::optional<ModbusRequest> take_rtu_request(std::vector<std::uint8_t>& bytes);

/// The answer's bytes to `request`.
std::vector<std::uint8_t> tcp_answer(const ModbusRequest& request, std::span<const std::uint8_t> pdu);
std::vector<std::uint8_t> rtu_answer(const ModbusRequest& request, std::span<const std::uint8_t> pdu);

/// CRC-16 of a serial frame (2.5.1.2 and appendix B): polynomial 0xA001 (reflected), initially 0xFFFF.
std::uint16_t modbus_crc(std::span<const std::uint8_t> bytes);

}  // namespace trn
