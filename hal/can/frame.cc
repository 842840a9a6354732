#include "hal/can/frame.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/check.h"

namespace trn {

CanFrame make_frame(std::uint32_t id, std::span<const std::uint8_t> bytes) TRN_RT {
  CanFrame frame;
  frame.id = id;
  frame.size = static_cast<std::uint8_t>(std::min<std::size_t>(bytes.size(), 8));
  std::copy_n(bytes.begin(), frame.size, frame.data.begin());
  return frame;
}

CanFrame make_frame(std::uint32_t id, std::initializer_list<std::uint8_t> bytes) TRN_RT {
  return make_frame(id, std::span<const std::uint8_t>(bytes.begin(), bytes.size()));
}

std::uint64_t get_le(const std::uint8_t* bytes, int size) TRN_RT {
  TRN_CHECK(size >= 0 && size <= 8);
  std::uint64_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8 | bytes[i];
  return value;
}

void put_le(std::uint8_t* bytes, int size, std::uint64_t value) TRN_RT {
  TRN_CHECK(size >= 0 && size <= 8);
  for (int i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

std::int64_t get_le_signed(const std::uint8_t* bytes, int size) TRN_RT {
  const int unused = 64 - 8 * size;
  TRN_CHECK(unused >= 0 && unused < 64);
  // The sign bit is moved to the top, and the arithmetic shift back carries it along.
  return static_cast<std::int64_t>(get_le(bytes, size) << unused) >> unused;
}

int fd_size(int bytes) TRN_RT {
  // The lengths that an FD frame may have beyond 8 bytes (ISO 11898-1). What lies between is filled up.
  for (const int size : {12, 16, 20, 24, 32, 48})
    if (bytes > 8 && bytes <= size) return size;
  return bytes <= 8 ? bytes : 64;
}

std::string to_string(const CanFrame& frame) {
  std::string text = frame.extended ? fmt::format("{:08X}#", frame.id) : fmt::format("{:03X}#", frame.id);
  if (frame.remote) return text + "R";
  return text + fmt::format("{:02X}", fmt::join(frame.bytes(), " "));
}

}  // namespace trn
