#include "hal/wire_layout.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = WireField::Kind;

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}
Bytes bytes_of(const std::string& text) { return Bytes(text.begin(), text.end()); }

constexpr std::int64_t kHash = 0x0102030405060708;
const Bytes kHashBytes{1, 2, 3, 4, 5, 6, 7, 8};

bool fits(const Bytes& fields, const std::vector<WireField>& layout) {
  return well_formed(kHashBytes + fields, kHash, layout);
}

TEST(WireLayout, NumbersTakeTheirBytes) {
  const std::vector<WireField> layout{{Kind::kNumber, 8, 1, -1}, {Kind::kNumber, 2, 3, -1}};
  for (int size = 0; size < 30; ++size)
    EXPECT_EQ(fits(Bytes(static_cast<std::size_t>(size), 0xFF), layout), size == 14) << size;
  EXPECT_TRUE(fits({}, {}));
}

TEST(WireLayout, TheHashIsTheTypes) {
  for (std::size_t i = 0; i < 8; ++i) {
    Bytes payload = kHashBytes;
    payload[i] ^= 0x80;
    EXPECT_FALSE(well_formed(payload, kHash, {})) << i;
    EXPECT_FALSE(well_formed({kHashBytes.data(), i}, kHash, {})) << i;
  }
  EXPECT_TRUE(well_formed(Bytes{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFE}, -2, {}));
}

// Length with the zero at the end, big-endian (LCM type specification).
TEST(WireLayout, ATextEndsWithItsOnlyZero) {
  const std::vector<WireField> layout{{Kind::kString, 1, 1, -1}};
  EXPECT_TRUE(fits({0, 0, 0, 1, 0}, layout)) << "empty";
  EXPECT_TRUE(fits({0, 0, 0, 3, 'a', 'b', 0}, layout));
  EXPECT_FALSE(fits({0, 0, 0, 0}, layout)) << "without its zero";
  EXPECT_FALSE(fits({0, 0, 0, 3, 'a', 'b', 'c'}, layout)) << "without its zero";
  EXPECT_FALSE(fits({0, 0, 0, 3, 'a', 0, 0}, layout)) << "a zero within";
  EXPECT_FALSE(fits({0, 0, 0, 4, 'a', 'b', 0}, layout)) << "longer than what is there";
  EXPECT_FALSE(fits({0, 0, 0, 2, 'a', 0, 0}, layout)) << "something behind it";
  EXPECT_FALSE(fits({0x80, 0, 0, 3, 'a', 'b', 0}, layout)) << "negative";
  EXPECT_FALSE(fits({0, 0, 3}, layout));
}

// Two counts; the second one's fields stand where the layout says, whatever the first is.
TEST(WireLayout, CountsSayHowManyElementsFollow) {
  const std::vector<WireField> layout{{Kind::kCount, 4, 1, -1},
                                      {Kind::kNumber, 8, 1, 0},
                                      {Kind::kCount, 4, 1, -1},
                                      {Kind::kString, 1, 1, 1},
                                      {Kind::kNumber, 1, 1, 0}};
  const Bytes text{0, 0, 0, 2, 'x', 0};
  EXPECT_TRUE(fits(Bytes{0, 0, 0, 2} + Bytes(16, 7) + Bytes{0, 0, 0, 1} + text + Bytes(2, 7), layout));
  EXPECT_FALSE(fits(Bytes{0, 0, 0, 2} + Bytes(16, 7) + Bytes{0, 0, 0, 1} + text + Bytes(1, 7), layout));
  EXPECT_TRUE(fits(Bytes{0, 0, 0, 0} + Bytes{0, 0, 0, 3} + text + text + text, layout));
  EXPECT_TRUE(fits(Bytes{0, 0, 0, 1} + Bytes(8, 7) + Bytes{0, 0, 0, 0} + Bytes(1, 7), layout));
  EXPECT_FALSE(fits(Bytes{0xFF, 0xFF, 0xFF, 0xFF} + Bytes{0, 0, 0, 0}, layout)) << "fewer than none";
  EXPECT_FALSE(fits(Bytes{0x7F, 0xFF, 0xFF, 0xFF} + Bytes(64, 0), layout)) << "more than there is room for";
}

TEST(WireLayout, ADatagramIsHeadChannelAndPayload) {
  const Bytes head{'L', 'C', '0', '2', 0x01, 0x02, 0x03, 0x04, 'm', '.', 'c', 0}, payload{9, 0, 8};
  EXPECT_EQ(datagram_head(0x01020304, "m.c"), head);
  const Bytes datagram = head + payload;
  const std::optional<WireMessage> message = read_datagram(datagram);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, "m.c");
  EXPECT_EQ(Bytes(message->payload.begin(), message->payload.end()), payload);
  EXPECT_TRUE(read_datagram(head)->payload.empty());
  for (std::size_t size = 0; size < head.size(); ++size)
    EXPECT_FALSE(read_datagram({head.data(), size})) << size;
  for (std::size_t i = 0; i < 4; ++i) {
    Bytes other = datagram;
    other[i] ^= 1;  // with the fourth, a fragment: LC03
    EXPECT_FALSE(read_datagram(other)) << i;
  }
}

TEST(WireLayout, AChannelHasOneTo63Bytes) {
  for (const std::size_t length : {0u, 1u, 62u, 63u, 64u, 65u}) {
    const Bytes datagram = bytes_of("LC02\1\1\1\1" + std::string(length, 'c')) + Bytes{0} + Bytes(100, 0);
    const std::optional<WireMessage> message = read_datagram(datagram);
    ASSERT_EQ(message.has_value(), length >= 1 && length <= 63) << length;
    EXPECT_EQ(message ? message->channel.size() : length, length);
  }
}

}  // namespace
}  // namespace trn
