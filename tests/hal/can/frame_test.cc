#include "hal/can/frame.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

// CiA 301, 7.1.3: the lowest byte first.
namespace trn {
namespace {

TEST(CanFrame, IntegersBeginWithTheirLowestByte) {
  std::array<std::uint8_t, 8> bytes{};
  put_le(bytes.data(), 4, 0x11223344u);
  EXPECT_EQ(bytes, (std::array<std::uint8_t, 8>{0x44, 0x33, 0x22, 0x11, 0, 0, 0, 0}));
  EXPECT_EQ(get_le(bytes.data(), 4), 0x11223344u);
  EXPECT_EQ(get_le(bytes.data(), 2), 0x3344u);
  EXPECT_EQ(get_le(bytes.data() + 1, 3), 0x112233u);
}

TEST(CanFrame, NegativeNumbersOfEveryLengthComeBack) {
  for (int size = 1; size <= 8; ++size) {
    const std::int64_t low = size == 8 ? INT64_MIN : -(std::int64_t{1} << (8 * size - 1));
    const std::int64_t high = size == 8 ? INT64_MAX : (std::int64_t{1} << (8 * size - 1)) - 1;
    for (const std::int64_t value : {low, std::int64_t{-1}, std::int64_t{0}, std::int64_t{1}, high}) {
      std::array<std::uint8_t, 8> bytes{};
      put_le(bytes.data(), size, static_cast<std::uint64_t>(value));
      EXPECT_EQ(get_le_signed(bytes.data(), size), value) << size;
    }
  }
}

TEST(CanFrame, AClassicFrameHasEightBytesAtMost) {
  const std::vector<std::uint8_t> ten(10, 0xAB);
  const CanFrame frame = make_frame(0x181, ten);
  EXPECT_EQ(frame.size, 8);
  EXPECT_EQ(frame.data[7], 0xAB);
  EXPECT_EQ(frame.data[8], 0);
  EXPECT_FALSE(frame.fd || frame.extended || frame.remote || frame.error);
  EXPECT_EQ(to_string(make_frame(0x005, {0x0A, 0xFF})), "005#0A FF");
}

}  // namespace
}  // namespace trn
