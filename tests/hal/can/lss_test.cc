#include "hal/can/lss.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

// Layer setting services against the bytes of CiA 305, clause 6.
namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr std::int64_t kTimeout = 20'000'000;

std::vector<Bytes> sent(LssMaster& master) {
  std::vector<Bytes> out;
  CanFrame frame;
  while (master.next_frame(frame)) {
    EXPECT_EQ(frame.id, 0x7E5u);
    EXPECT_EQ(frame.size, 8);
    out.emplace_back(frame.data.begin(), frame.data.begin() + 8);
  }
  return out;
}

CanFrame answer(std::initializer_list<std::uint8_t> bytes) {
  CanFrame frame = make_frame(0x7E4, bytes);
  frame.size = 8;
  return frame;
}

TEST(Lss, SelectsByFourNumbers) {
  LssMaster master(kTimeout);
  master.select({0x11223344, 2, 3, 0xFFFFFFFF}, 0);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x04, 0, 0, 0, 0, 0, 0, 0},
                                              {0x40, 0x44, 0x33, 0x22, 0x11, 0, 0, 0},
                                              {0x41, 2, 0, 0, 0, 0, 0, 0},
                                              {0x42, 3, 0, 0, 0, 0, 0, 0},
                                              {0x43, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0}}));
  EXPECT_EQ(master.state(), LssMaster::State::kBusy);
  master.receive(answer({0x44}), 1);
  EXPECT_EQ(master.state(), LssMaster::State::kDone);
}

TEST(Lss, ConfiguresTheSelected) {
  LssMaster master(kTimeout);
  master.set_node_id(5, 0);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x11, 5, 0, 0, 0, 0, 0, 0}}));
  master.receive(answer({0x11, 0, 0}), 1);
  EXPECT_EQ(master.error(), "");
  EXPECT_EQ(master.state(), LssMaster::State::kDone);
  master.set_bit_rate(*lss_bit_rate_index(250'000), 2);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x13, 0, 3, 0, 0, 0, 0, 0}}));
  master.receive(answer({0x13, 1, 0}), 3);
  EXPECT_NE(master.error().find("does not know this bit rate"), std::string::npos) << master.error();
  master.store(4);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x17, 0, 0, 0, 0, 0, 0, 0}}));
  master.receive(answer({0x17, 1, 0}), 5);
  EXPECT_NE(master.error().find("0x1010"), std::string::npos) << master.error();
  master.ask_node_id(6);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x5E, 0, 0, 0, 0, 0, 0, 0}}));
  master.receive(answer({0x5E, 9}), 7);
  master.poll(6 + kTimeout);
  EXPECT_EQ(master.error(), "");
  EXPECT_EQ(master.node_id(), 9);
}

// Serial number 0 is common: two such drives are selected by the same four numbers, and would get one node
// id.
TEST(Lss, TwoAnswersForTheNodeIdAreTwoNodes) {
  for (const std::uint8_t second : {std::uint8_t{255}, std::uint8_t{4}}) {
    LssMaster master(kTimeout);
    master.ask_node_id(0);
    sent(master);
    master.receive(answer({0x5E, 255}), 1);
    EXPECT_EQ(master.state(), LssMaster::State::kBusy) << "the second may still come";
    master.receive(answer({0x5E, second}), 2);
    master.poll(kTimeout);
    EXPECT_EQ(master.state(), LssMaster::State::kFailed);
    EXPECT_NE(master.error().find("one at a time"), std::string::npos) << master.error();
  }
}

TEST(Lss, ANodeIdThatNobodyCanHaveIsToldSo) {
  for (const int id : {0, 128, 200, 254}) {
    LssMaster master(kTimeout);
    master.ask_node_id(0);
    sent(master);
    master.receive(answer({0x5E, static_cast<std::uint8_t>(id)}), 1);
    master.poll(kTimeout);
    EXPECT_EQ(master.state(), LssMaster::State::kFailed) << id;
    EXPECT_NE(master.error().find("1 to 127"), std::string::npos) << master.error();
  }
}

TEST(Lss, AnAnswerOfTheWrongSizeIsNoAnswerAndIsNamed) {
  for (int size = 1; size < 8; ++size) {
    LssMaster master(kTimeout);
    master.store(0);
    sent(master);
    CanFrame cut = answer({0x17, 0});
    cut.size = static_cast<std::uint8_t>(size);
    master.receive(cut, 1);
    master.poll(kTimeout - 1);
    EXPECT_EQ(master.state(), LssMaster::State::kBusy);
    master.poll(kTimeout);
    EXPECT_NE(master.error().find("of " + std::to_string(size) + " bytes"), std::string::npos)
        << master.error();
  }
  LssMaster master(kTimeout);
  master.store(0);
  sent(master);
  CanFrame empty = answer({0x17, 0});
  empty.size = 0;
  master.receive(empty, 1);
  master.poll(kTimeout);
  EXPECT_NE(master.error().find("silent"), std::string::npos) << master.error();
}

// An answer that comes when its question is given up is no answer to the next one, unless it is the same.
TEST(Lss, ALateAnswerToAnotherServiceIsPassedOver) {
  LssMaster master(kTimeout);
  master.set_node_id(5, 0);
  sent(master);
  master.poll(kTimeout);
  EXPECT_EQ(master.state(), LssMaster::State::kFailed);
  master.receive(answer({0x11, 0}), kTimeout + 1);
  EXPECT_EQ(master.state(), LssMaster::State::kFailed) << "it was told so";
  master.store(kTimeout + 2);
  master.receive(answer({0x11, 0}), kTimeout + 3);
  EXPECT_EQ(master.state(), LssMaster::State::kBusy);
  master.receive(answer({0x17, 0}), kTimeout + 4);
  EXPECT_EQ(master.state(), LssMaster::State::kDone);
}

// What another service, another node or noise sends is no answer; silence ends every service with a remedy.
TEST(Lss, TakesNoOtherFrameForAnAnswer) {
  LssMaster master(kTimeout);
  master.set_node_id(5, 0);
  sent(master);
  CanFrame foreign = answer({0x11, 0});
  foreign.id = 0x584;
  master.receive(foreign, 1);
  foreign = answer({0x11, 0});
  foreign.extended = true;
  master.receive(foreign, 1);
  master.receive(answer({0x17, 0}), 1);
  master.poll(kTimeout - 1);
  EXPECT_EQ(master.state(), LssMaster::State::kBusy);
  master.poll(kTimeout);
  EXPECT_NE(master.error().find("silent"), std::string::npos);
  master.find(0);
  sent(master);
  master.poll(kTimeout);
  EXPECT_NE(master.error().find("no node without a node id answers"), std::string::npos) << master.error();
}

// CiA 305, 6.10: number, bits checked, part, next part
TEST(Lss, AsksBitByBit) {
  LssMaster master(kTimeout);
  master.find(0);
  EXPECT_EQ(sent(master), (std::vector<Bytes>{{0x04, 0, 0, 0, 0, 0, 0, 0}, {0x51, 0, 0, 0, 0, 0x80, 0, 0}}));
  const std::vector<std::uint32_t> identity = {0x80000001, 0, 0xFFFFFFFF, 0x12345678};
  std::int64_t now = 0;
  std::vector<Bytes> last;
  for (std::size_t part = 0; part < 4; ++part)
    for (int bit = 31; bit >= -1; --bit) {
      // The question before is answered where it must be.
      const bool first = part == 0 && bit == 31;
      if (first || last.front()[0] == 0x51) {
        const std::uint32_t number =
            first ? 0 : static_cast<std::uint32_t>(get_le(last.front().data() + 1, 4));
        const unsigned checked = first ? 0 : last.front()[5];
        const std::size_t of = first ? 0 : last.front()[6];
        if (first || ((number ^ identity[of]) >> checked) == 0) master.receive(answer({0x4F}), now);
      }
      master.poll(now += kTimeout);
      last = sent(master);
      ASSERT_EQ(last.size(), 1u);
      EXPECT_EQ(last.front()[5], std::max(bit, 0));
      EXPECT_EQ(last.front()[6], part);
      EXPECT_EQ(last.front()[7], bit < 0 ? (part + 1) % 4 : part);
    }
  master.receive(answer({0x4F}), now);
  master.poll(now + kTimeout);
  EXPECT_EQ(master.state(), LssMaster::State::kDone);
  EXPECT_EQ(master.identity(), (LssIdentity{0x80000001, 0, 0xFFFFFFFF, 0x12345678}));
}

TEST(Lss, KnowsTheStandardsBitRates) {
  EXPECT_EQ(lss_bit_rate_index(1'000'000), 0);
  EXPECT_EQ(lss_bit_rate_index(125'000), 4);
  EXPECT_EQ(lss_bit_rate_index(50'000), 6);
  EXPECT_EQ(lss_bit_rate_index(100'000), std::nullopt) << "reserved";
}

}  // namespace
}  // namespace trn
