#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

#include "core/realtime.h"

namespace trn {

/// One CAN frame, classic or FD (ISO 11898-1), or a controller's error report.
struct CanFrame {
  std::uint32_t id = 0;      ///< 11 or 29 bits; of an error report: the kernel's error classes
  std::uint8_t size = 0;     ///< data bytes: 0 to 8, FD to 64
  bool extended = false;     ///< 29-bit identifier
  bool remote = false;       ///< asks for data
  bool error = false;        ///< not from the bus: the controller's own report
  bool fd = false;           ///< FD format
  std::int64_t time_ns = 0;  ///< reception, CLOCK_REALTIME on a real interface, bus time on a virtual one
  std::array<std::uint8_t, 64> data{};

  std::span<const std::uint8_t> bytes() const TRN_RT { return {data.data(), size}; }
};

/// A classic data frame with an 11-bit identifier; at most 8 bytes are taken.
CanFrame make_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) TRN_RT;
CanFrame make_frame(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) TRN_RT;

/// Little-endian integers, as CANopen transmits them (CiA 301, 7.1.3); size 1 to 8 bytes.
std::uint64_t get_le(const std::uint8_t* bytes, int size) TRN_RT;
void put_le(std::uint8_t* bytes, int size, std::uint64_t value) TRN_RT;
/// The same as two's complement.
std::int64_t get_le_signed(const std::uint8_t* bytes, int size) TRN_RT;

/// The shortest legal length of an FD frame that holds so many bytes (ISO 11898-1: 0 to 8, 12, 16, 20, 24,
/// 32, 48, 64).
int fd_size(int bytes) TRN_RT;

/// "181#37 02 10" and the like, for messages.
std::string to_string(const CanFrame& frame);

}  // namespace trn
