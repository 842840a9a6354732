#include "sim/canopen/sdo_server.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/sdo.h"
#include "sim/canopen/frame_queue.h"
#include "sim/canopen/object_store.h"

// Frames written by hand from CiA 301, 7.2.4.3. The check value of the block transfer's CRC (CRC-16/XMODEM)
// of "123456789" is 0x31C3.
namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

class SdoServers : public testing::Test {
 protected:
  SdoServers()
      : store_(dictionary()), server_(4, store_, [this](ObjectKey key) { written_.push_back(key); }) {}

  static ObjectDictionary dictionary() {
    const auto object = [](const std::string& key, const std::string& type, const std::string& value) {
      return "[" + key + "]\nParameterName=P\nDataType=" + type + "\nAccessType=rw\nDefaultValue=" + value +
             "\n";
    };
    return parse_eds(object("2000", "7", "0x11223344") + object("2001", "9", "123456789") +
                         object("2002", "9", "abcdefghijklmn") + object("2003", "6", "0x5566"),
                     "x.eds", 4);
  }
  /// The answers to one request, without the zeros at the end of each.
  std::vector<Bytes> ask(const Bytes& request) {
    CanFrame frame;
    frame.id = 0x604;
    frame.size = 8;
    std::copy(request.begin(), request.end(), frame.data.begin());
    FrameQueue queue(200);
    server_.receive(frame, queue);
    std::vector<Bytes> out;
    for (; !queue.empty(); queue.pop()) {
      EXPECT_EQ(queue.front().id, 0x584u);
      EXPECT_EQ(queue.front().size, 8);
      out.emplace_back(queue.front().data.begin(), queue.front().data.begin() + 8);
      while (!out.back().empty() && out.back().back() == 0) out.back().pop_back();
    }
    return out;
  }
  static Bytes segment(std::uint8_t head, const std::string& text) {
    Bytes out(1 + text.size(), head);
    std::copy(text.begin(), text.end(), out.begin() + 1);
    return out;
  }
  std::string text(std::uint16_t index) {
    const Bytes& bytes = *store_.bytes({index, 0});
    return {bytes.begin(), bytes.end()};
  }

  ObjectStore store_;
  std::vector<ObjectKey> written_;
  SdoServer server_;
};
using Answers = std::vector<Bytes>;

TEST_F(SdoServers, FourBytesTravelInOneFrame) {
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 0}), (Answers{{0x43, 0x00, 0x20, 0, 0x44, 0x33, 0x22, 0x11}}));
  EXPECT_EQ(ask({0x40, 0x03, 0x20, 0}), (Answers{{0x4B, 0x03, 0x20, 0, 0x66, 0x55}}));
  EXPECT_EQ(ask({0x23, 0x00, 0x20, 0, 1, 2, 3, 4}), (Answers{{0x60, 0x00, 0x20}}));
  EXPECT_EQ(store_.integer({0x2000, 0}), 0x04030201);
  EXPECT_EQ(ask({0x2B, 0x03, 0x20, 0, 7, 8}), (Answers{{0x60, 0x03, 0x20}}));
  EXPECT_EQ(store_.integer({0x2003, 0}), 0x0807);
  EXPECT_EQ(written_, (std::vector<ObjectKey>{{0x2000, 0}, {0x2003, 0}}));
}

TEST_F(SdoServers, WhatIsNotThereIsAborted) {
  EXPECT_EQ(ask({0x40, 0x10, 0x20, 0}), (Answers{{0x80, 0x10, 0x20, 0, 0x00, 0x00, 0x02, 0x06}}));
  EXPECT_EQ(ask({0x23, 0x03, 0x20, 0, 1, 2, 3, 4}), (Answers{{0x80, 0x03, 0x20, 0, 0x12, 0x00, 0x07, 0x06}}));
  server_.refuse(0x2000, sdo_abort::kGeneral);
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 0}), (Answers{{0x80, 0x00, 0x20, 0, 0x00, 0x00, 0x00, 0x08}}));
  server_.refuse(0, 0);
  EXPECT_EQ(ask({0x40, 0x00, 0x20, 0}).at(0).at(0), 0x43);
  EXPECT_TRUE(written_.empty());
}

TEST_F(SdoServers, SegmentsGoByTurns) {
  EXPECT_EQ(ask({0x40, 0x01, 0x20, 0}), (Answers{{0x41, 0x01, 0x20, 0, 9}}));
  EXPECT_EQ(ask({0x60}), (Answers{segment(0x00, "1234567")}));
  EXPECT_EQ(ask({0x70}), (Answers{segment(0x1B, "89")})) << "toggled, five unused, the last";
  EXPECT_EQ(ask({0x21, 0x01, 0x20, 0, 9}), (Answers{{0x60, 0x01, 0x20}}));
  EXPECT_EQ(ask(segment(0x00, "ABCDEFG")), (Answers{{0x20}}));
  EXPECT_EQ(text(0x2001), "123456789") << "not before the end";
  EXPECT_EQ(ask(segment(0x1B, "HI")), (Answers{{0x30}}));
  EXPECT_EQ(text(0x2001), "ABCDEFGHI");
  ASSERT_EQ(ask({0x40, 0x01, 0x20, 0}).size(), 1u);
  EXPECT_EQ(ask({0x70}), (Answers{{0x80, 0x01, 0x20, 0, 0x00, 0x00, 0x03, 0x05}})) << "not its turn";
}

TEST_F(SdoServers, ABlockIsTakenWithItsCrc) {
  for (const bool right : {false, true}) {
    const Answers begin = ask({0xC6, 0x02, 0x20, 0, 9});
    ASSERT_EQ(begin.size(), 1u);
    EXPECT_EQ(begin[0][0], 0xA4) << "with CRC";
    const std::uint8_t size = begin[0].at(4);
    ASSERT_GE(size, 2);
    EXPECT_TRUE(ask(segment(1, "1234567")).empty());
    EXPECT_EQ(ask(segment(0x82, "89")), (Answers{{0xA2, 2, size}}));
    const std::uint8_t low = right ? 0xC3 : 0xC2;
    const Bytes wrong{0x80, 0x02, 0x20, 0, 0x04, 0x00, 0x04, 0x05};
    EXPECT_EQ(ask({0xD5, low, 0x31}), (Answers{right ? Bytes{0xA1} : wrong}));
    EXPECT_EQ(text(0x2002), right ? "123456789" : "abcdefghijklmn");
  }
}

// Fourteen bytes are two whole segments, and no third.
TEST_F(SdoServers, ABlockIsGivenWithItsCrc) {
  EXPECT_EQ(ask({0xA4, 0x01, 0x20, 0, 127, 0}), (Answers{{0xC6, 0x01, 0x20, 0, 9}}));
  EXPECT_EQ(ask({0xA3}), (Answers{segment(0x01, "1234567"), segment(0x82, "89")}));
  EXPECT_EQ(ask({0xA2, 2, 127}), (Answers{{0xD5, 0xC3, 0x31}})) << "five unused; CRC";
  EXPECT_TRUE(ask({0xA1}).empty());
  EXPECT_EQ(ask({0xA4, 0x02, 0x20, 0, 127, 0}), (Answers{{0xC6, 0x02, 0x20, 0, 14}}));
  EXPECT_EQ(ask({0xA3}), (Answers{segment(0x01, "abcdefg"), segment(0x82, "hijklmn")}));
}

// Blocks of one segment; what did not arrive is sent again.
TEST_F(SdoServers, ABlockIsAsLongAsTheClientWants) {
  ask({0xA4, 0x02, 0x20, 0, 1, 0});
  EXPECT_EQ(ask({0xA3}), (Answers{segment(0x01, "abcdefg")}));
  EXPECT_EQ(ask({0xA2, 0, 1}), (Answers{segment(0x01, "abcdefg")}));
  EXPECT_EQ(ask({0xA2, 1, 1}), (Answers{segment(0x81, "hijklmn")}));
  EXPECT_EQ(ask({0xA2, 1, 1}).at(0).at(0), 0xC1);
}

}  // namespace
}  // namespace trn
