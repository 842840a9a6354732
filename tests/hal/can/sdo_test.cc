#include "hal/can/sdo.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>

namespace trn {
namespace {

TEST(Sdo, KeysAreWrittenWithTheirSubIndexUnlessItSaysNothing) {
  EXPECT_EQ(to_string(ObjectKey{0x6041, 0}, false), "0x6041");
  EXPECT_EQ(to_string(ObjectKey{0x6041, 0}), "0x6041:0");
  EXPECT_EQ(to_string(ObjectKey{0x1018, 1}, false), "0x1018:1");
  EXPECT_EQ(to_string(ObjectKey{0x1018, 12}), "0x1018:12");
}

// A segment's number is never 0, so a frame that begins with 0x80 is the node's abort, also after a lost
// segment (CiA 301, 7.2.4.3.13 and 7.2.4.3.17).
TEST(SdoClient, ANodeMayAbortABlockUploadAfterALostSegment) {
  SdoClient client({5, 1'000'000, 1 << 16, 64, true});
  const auto answer = [&](std::initializer_list<std::uint8_t> bytes) {
    client.receive(make_frame(0x585, bytes), 0);
  };
  client.read({0x2000, 0}, 0);
  answer({0xC6, 0x00, 0x20, 0x00, 16, 0, 0, 0});
  answer({0x01, 0, 1, 2, 3, 4, 5, 6});
  answer({0x03, 14, 15, 0, 0, 0, 0, 0});  // the second one was lost
  answer({0x80, 0x00, 0x20, 0x00, 0x00, 0x00, 0x00, 0x08});
  EXPECT_EQ(client.state(), SdoClient::State::kAborted);
  EXPECT_EQ(client.abort_code(), 0x08000000u);
  EXPECT_TRUE(client.aborted_by_node());
}

// Each answer renews the time-out, so a node that acknowledges no segment of any block must be given up by
// count.
TEST(SdoClient, ANodeThatTakesNoSegmentOfABlockIsGivenUp) {
  SdoClient client({5, 1'000'000, 1 << 16, 64, true});
  const std::vector<std::uint8_t> data(100, 7);
  client.write({0x2000, 0}, data, 0);
  const auto sent = [&] {
    int count = 0;
    for (CanFrame frame; client.next_frame(frame); ++count) continue;
    return count;
  };
  EXPECT_EQ(sent(), 1);
  client.receive(make_frame(0x585, {0xA0, 0x00, 0x20, 0x00, 4, 0, 0, 0}), 0);
  int blocks = 0;
  while (client.state() == SdoClient::State::kBusy && blocks < 100) {
    EXPECT_EQ(sent(), 4);
    ++blocks;
    client.receive(make_frame(0x585, {0xA2, 0, 4, 0, 0, 0, 0, 0}), 0);
  }
  EXPECT_EQ(client.state(), SdoClient::State::kAborted);
  EXPECT_EQ(blocks, 4) << "the first and three more";
}

// CiA 301, 7.2.4.3.15: the server's answer has command 0xC0 to 0xC6 and names the object that was asked for.
TEST(SdoClient, AnAnswerOfAnotherKindOrObjectEndsABlockUpload) {
  const auto state_after = [](std::initializer_list<std::uint8_t> bytes) {
    SdoClient client({5, 1'000'000, 1 << 16, 64, true});
    client.read({0x2000, 0}, 0);
    client.receive(make_frame(0x585, bytes), 0);
    return client.state();
  };
  EXPECT_EQ(state_after({0xC6, 0x00, 0x20, 0x00, 16, 0, 0, 0}), SdoClient::State::kBusy);
  EXPECT_EQ(state_after({0xC6, 0x00, 0x20, 0x00, 0, 0, 1, 0}), SdoClient::State::kBusy)
      << "as large as may be";
  EXPECT_EQ(state_after({0xC6, 0x00, 0x20, 0x00, 1, 0, 1, 0}), SdoClient::State::kAborted);
  EXPECT_EQ(state_after({0x43, 0x00, 0x20, 0x00, 16, 0, 0, 0}), SdoClient::State::kAborted);
  EXPECT_EQ(state_after({0xC6, 0x01, 0x20, 0x00, 16, 0, 0, 0}), SdoClient::State::kAborted);
}

}  // namespace
}  // namespace trn
