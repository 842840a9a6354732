#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <string>

#include "core/config.h"
#include "hal/can/bus_budget.h"
#include "hal/can/cia402.h"
#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "hal/can/pdo.h"
#include "hal/can/sdo.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes sent(SdoClient& client) {
  CanFrame frame;
  if (!client.next_frame(frame)) return {};
  EXPECT_EQ(frame.id, 0x605u);
  return {frame.data.begin(), frame.data.begin() + frame.size};
}

void answer(SdoClient& client, std::initializer_list<std::uint8_t> bytes) {
  client.receive(make_frame(0x585, bytes), 0);
}

SdoClient client_of_node_5(bool block_upload = false) {
  return SdoClient({5, 1'000'000, 1 << 16, 64, block_upload});
}

// Byte for byte as CiA 301, 7.2.4.3.2 to 7.2.4.3.6 lay the frames out.
TEST(SdoClient, ExpeditedBothWays) {
  SdoClient client = client_of_node_5();
  client.write({0x1017, 0}, Bytes{0xE8, 0x03}, 0);
  EXPECT_EQ(sent(client), (Bytes{0x2B, 0x17, 0x10, 0x00, 0xE8, 0x03, 0, 0}));
  answer(client, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(client.state(), SdoClient::State::kDone);
  client.read({0x1018, 2}, 0);
  EXPECT_EQ(sent(client), (Bytes{0x40, 0x18, 0x10, 0x02, 0, 0, 0, 0}));
  answer(client, {0x43, 0x18, 0x10, 0x02, 0x02, 0x04, 0x00, 0x00});
  EXPECT_EQ(client.data(), (Bytes{2, 4, 0, 0}));
  client.read({0x6061, 0}, 0);
  sent(client);
  answer(client, {0x4F, 0x61, 0x60, 0x00, 0x08, 0, 0, 0});
  EXPECT_EQ(client.data(), (Bytes{8}));
}

TEST(SdoClient, SegmentedUpload) {
  SdoClient client = client_of_node_5();
  client.read({0x1008, 0}, 0);
  sent(client);
  answer(client, {0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  EXPECT_EQ(sent(client), (Bytes{0x60, 0, 0, 0, 0, 0, 0, 0}));
  answer(client, {0x00, 'T', 'r', 'u', 'n', 'n', 'i', 'o'});
  EXPECT_EQ(sent(client), (Bytes{0x70, 0, 0, 0, 0, 0, 0, 0}));
  answer(client, {0x1B, 'n', '!', 0, 0, 0, 0, 0});
  ASSERT_EQ(client.state(), SdoClient::State::kDone);
  EXPECT_EQ(std::string(client.data().begin(), client.data().end()), "Trunnion!");
}

TEST(SdoClient, SegmentedDownloadTogglesAndCountsUnusedBytes) {
  SdoClient client = client_of_node_5();
  const Bytes nine = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  client.write({0x2000, 0}, nine, 0);
  EXPECT_EQ(sent(client), (Bytes{0x21, 0x00, 0x20, 0x00, 9, 0, 0, 0}));
  answer(client, {0x60, 0x00, 0x20, 0x00, 0, 0, 0, 0});
  EXPECT_EQ(sent(client), (Bytes{0x00, 1, 2, 3, 4, 5, 6, 7}));
  answer(client, {0x20, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(client), (Bytes{0x1B, 8, 9, 0, 0, 0, 0, 0}));
  answer(client, {0x30, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(client.state(), SdoClient::State::kDone);
}

TEST(SdoClient, WrongToggleIsAborted) {
  SdoClient client = client_of_node_5();
  client.read({0x1008, 0}, 0);
  sent(client);
  answer(client, {0x41, 0x08, 0x10, 0x00, 9, 0, 0, 0});
  sent(client);
  answer(client, {0x10, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(client.state(), SdoClient::State::kAborted);
  EXPECT_EQ(sent(client), (Bytes{0x80, 0x08, 0x10, 0x00, 0x00, 0x00, 0x03, 0x05}));
}

TEST(SdoClient, TheNodesAbortAndItsSilence) {
  SdoClient client = client_of_node_5();
  client.read({0x2345, 1}, 0);
  answer(client, {0x80, 0x45, 0x23, 0x01, 0x00, 0x00, 0x02, 0x06});
  EXPECT_EQ(client.abort_code(), 0x06020000u);
  EXPECT_TRUE(client.aborted_by_node());
  client.read({0x2345, 1}, 0);
  client.poll(999'999);
  EXPECT_EQ(client.state(), SdoClient::State::kBusy);
  client.poll(1'000'000);
  EXPECT_EQ(client.abort_code(), sdo_abort::kTimeout);
  EXPECT_FALSE(client.aborted_by_node());
}

TEST(SdoClient, BlockUploadSurvivesALostSegment) {
  SdoClient client = client_of_node_5(true);
  client.read({0x2000, 0}, 0);
  EXPECT_EQ(sent(client), (Bytes{0xA4, 0x00, 0x20, 0x00, 127, 0, 0, 0}));
  answer(client, {0xC6, 0x00, 0x20, 0x00, 16, 0, 0, 0});
  EXPECT_EQ(sent(client)[0], 0xA3);
  answer(client, {0x01, 0, 1, 2, 3, 4, 5, 6});
  answer(client, {0x83, 14, 15, 0, 0, 0, 0, 0});  // the second one was lost
  EXPECT_EQ(sent(client), (Bytes{0xA2, 1, 127, 0, 0, 0, 0, 0}));
  answer(client, {0x01, 7, 8, 9, 10, 11, 12, 13});
  answer(client, {0x82, 14, 15, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(client), (Bytes{0xA2, 2, 127, 0, 0, 0, 0, 0}));
  Bytes all(16);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  const std::uint16_t crc = sdo_crc(all);
  answer(client, {0xD5, static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8), 0, 0, 0, 0, 0});
  EXPECT_EQ(client.state(), SdoClient::State::kDone);
  EXPECT_EQ(client.data(), all);
}

// CiA 301, 7.2.4.3.7 to 7.2.4.3.9: the node takes sub-blocks of four segments, and loses two of the first.
TEST(SdoClient, BlockDownloadSendsAgainWhatWasLost) {
  Bytes all(70);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  const auto segment = [&](int number, std::size_t from) {
    Bytes bytes{static_cast<std::uint8_t>(number)};
    bytes.insert(bytes.end(), all.begin() + static_cast<std::ptrdiff_t>(from),
                 all.begin() + static_cast<std::ptrdiff_t>(from) + 7);
    return bytes;
  };
  SdoClient client = client_of_node_5();
  client.write({0x2000, 0}, all, 0);
  EXPECT_EQ(sent(client), (Bytes{0xC6, 0x00, 0x20, 0x00, 70, 0, 0, 0}));
  answer(client, {0xA4, 0x00, 0x20, 0x00, 4, 0, 0, 0});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(sent(client), segment(i + 1, static_cast<std::size_t>(7 * i)));
  EXPECT_EQ(sent(client), Bytes{});
  answer(client, {0xA2, 2, 4, 0, 0, 0, 0, 0});
  for (int i = 0; i < 4; ++i) EXPECT_EQ(sent(client), segment(i + 1, static_cast<std::size_t>(14 + 7 * i)));
  answer(client, {0xA2, 4, 127, 0, 0, 0, 0, 0});
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(sent(client), segment(i == 3 ? 0x84 : i + 1, static_cast<std::size_t>(42 + 7 * i)));
  answer(client, {0xA2, 4, 127, 0, 0, 0, 0, 0});
  const std::uint16_t crc = sdo_crc(all);
  EXPECT_EQ(sent(client), (Bytes{0xC1, static_cast<std::uint8_t>(crc), static_cast<std::uint8_t>(crc >> 8), 0,
                                 0, 0, 0, 0}));
  EXPECT_EQ(client.state(), SdoClient::State::kBusy);
  answer(client, {0xA1, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(client.state(), SdoClient::State::kDone);
}

TEST(Sdo, CrcOfTheStandardsExample) {
  const std::string text =
      "123456789";  // check value of this polynomial with start 0: 0x31C3 (CRC-16/XMODEM)
  EXPECT_EQ(sdo_crc(Bytes(text.begin(), text.end())), 0x31C3);
}

TEST(SdoClient, RandomAnswersNeverHurt) {
  const long rounds = test::rounds(20'000);
  std::mt19937 random(1);
  SdoClient reader = client_of_node_5(), blocks = client_of_node_5(true);
  const Bytes data(200, 0x55);
  for (long i = 0; i < rounds; ++i) {
    if (reader.state() != SdoClient::State::kBusy)
      random() % 2 ? reader.read({0x1008, 0}, 0) : reader.write({0x2000, 0}, data, 0);
    if (blocks.state() != SdoClient::State::kBusy) blocks.read({0x2000, 0}, 0);
    std::array<std::uint8_t, 8> bytes;
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    if (random() % 2) {  // half of them look right at first sight
      const std::uint8_t index = random() % 2 ? 0x10 : 0x20;
      bytes[1] = index == 0x10 ? 8 : 0;
      bytes[2] = index;
      bytes[3] = 0;
    }
    CanFrame frame = make_frame(0x585, bytes);
    frame.size = static_cast<std::uint8_t>(random() % 10 ? 8 : random() % 9);
    reader.receive(frame, 0);
    blocks.receive(frame, 0);
    while (reader.next_frame(frame) || blocks.next_frame(frame)) ASSERT_EQ(frame.size, 8);
    ASSERT_LE(reader.data().size(), (1u << 16) + 7);
  }
}

TEST(Cia402, EveryStatuswordOfTheTable) {
  // CiA 402-2, table of 8.4.2, bits that do not matter set both ways
  for (const unsigned rest : {0x0000u, 0xFF90u}) {
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x00 | rest)), Cia402State::kNotReady);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x40 | rest)), Cia402State::kSwitchOnDisabled);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x60 | rest)), Cia402State::kSwitchOnDisabled);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x21 | rest)), Cia402State::kReadyToSwitchOn);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x23 | rest)), Cia402State::kSwitchedOn);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x27 | rest)), Cia402State::kOperationEnabled);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x07 | rest)), Cia402State::kQuickStopActive);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x0F | rest)), Cia402State::kFaultReactionActive);
    EXPECT_EQ(cia402_state(static_cast<std::uint16_t>(0x08 | rest)), Cia402State::kFault);
  }
}

TEST(BusBudget, WorstFrames) {
  // Davis et al. 2007: 8 bytes take 135 bits with an 11-bit identifier and 160 with 29 bits, none takes 55
  EXPECT_EQ(worst_frame_bits(0), 55);
  EXPECT_EQ(worst_frame_bits(8), 135);
  EXPECT_EQ(worst_frame_bits(8, true), 160);
}

TEST(BusBudget, NoFrameIsLongerThanTheWorst) {
  std::mt19937 random(2);
  int longest = 0;
  for (int i = 0; i < 20000; ++i) {
    CanFrame frame;
    frame.id = random() % 0x800;
    frame.size = 8;
    const auto pattern = static_cast<std::uint8_t>(random() % 3 ? random() : random() % 2 ? 0x00 : 0xFF);
    for (int k = 0; k < 8; ++k)
      frame.data[static_cast<std::size_t>(k)] = random() % 4 ? pattern : static_cast<std::uint8_t>(random());
    const int bits = frame_bits(frame);
    ASSERT_GE(bits, 8 * 8 + 47);
    ASSERT_LE(bits, worst_frame_bits(8));
    longest = std::max(longest, bits);
  }
  EXPECT_GT(longest, 125);
}

BusBudget drives(int count, double period_s) {
  BusBudget budget{"can0", 1e6, period_s, {}};
  budget.items = {
      {"SYNC", 1, 0, period_s}, {"setpoints", count, 7, period_s}, {"feedback", count, 7, period_s}};
  return budget;
}

TEST(BusBudget, SixAxesDoNotFitOneMillisecond) {
  EXPECT_FALSE(drives(6, 0.001).fits());  // 55 + 12 * 125 + 135 = 1690 us
  EXPECT_NEAR(drives(6, 0.001).needed_s(), 1690e-6, 1e-12);
  EXPECT_DOUBLE_EQ(drives(6, 0.001).smallest_period_s(), 0.002);
  EXPECT_TRUE(drives(3, 0.001).fits());
}

std::string eds_of(const std::string& more) {
  return "[DeviceInfo]\r\nVendorName=Antriebe GmbH\r\n; comment\r\n[1000]\nParameterName=Device "
         "type\nDataType=7\n"
         "AccessType=ro\nDefaultValue=0x00020192\n" +
         more;
}

TEST(Eds, TakesWhatVendorsWrite) {
  const ObjectDictionary eds = parse_eds(
      eds_of(
          "[1018]\nParameterName=Identity\nobjecttype=0x9\n[1018Sub1]\nParameterName=Vendor\nDataType="
          "0x0007\n"
          "AccessType=RO\nDefaultValue=$NODEID + 0x10 ; with a comment\n[6060]\nParameterName=Betriebsart "
          "f\xFCr\n"
          "DataType=2\nAccessType=rww\nDefaultValue=-1\nPDOMapping=1\n[MandatroyObjects]\nSupportedObjects="
          "1\n"
          "[6064]\nParameterName=Position\nDataType=4\nAccessType=ro\nnonsense\nDefaultValue=0xFFFFFFFE\n"),
      "x.eds", 5);
  EXPECT_EQ(eds.vendor, "Antriebe GmbH");
  EXPECT_EQ(eds.integer({0x1018, 1}), 0x15);
  EXPECT_EQ(eds.name_of({0x1018, 1}), "Identity: Vendor");
  EXPECT_EQ(eds.integer({0x6060, 0}), -1);
  EXPECT_EQ(eds.name_of({0x6060, 0}), "Betriebsart f\u00FCr");
  EXPECT_EQ(eds.integer({0x6064, 0}), -2);
  ASSERT_EQ(eds.warnings.size(), 2u);
  EXPECT_EQ(eds.warnings[0], "x.eds:29: neither section nor key=value; left out");
  EXPECT_EQ(eds.warnings[1], "x.eds:23: section [mandatroyobjects] is not known; left out");
}

TEST(Eds, ErrorsNameTheLine) {
  const auto message = [](const std::string& more) -> std::string {
    try {
      parse_eds(eds_of(more), "x.eds", 1);
    } catch (const EdsError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message("[1017]\nDataType=6\nDefaultValue=abc\n"),
            "x.eds:11: 'abc' is no number; legal: 123, -5, 0x1F, $NODEID+0x180");
  EXPECT_EQ(message("[1017]\nDataType=6\nDefaultValue=70000\n"), "x.eds:11: 70000 does not fit into 16 bits");
  EXPECT_EQ(message("[1017]\nObjectType=77\n"),
            "x.eds:9: [1017]: ObjectType 77 is not known; legal: 7 (variable), 8 (array), 9 (record)");
  EXPECT_NE(message("").size(), 1u);
}

TEST(Pdo, PacksInOrderAndRefusesWhatTheNodeDoesNotHave) {
  const ObjectDictionary eds = load_eds(source_dir() + "/configs/eds/servo.eds", 3);
  EXPECT_TRUE(eds.warnings.empty()) << eds.warnings[0];
  const auto pdos = plan_pdos(eds, {{0x6041, 0}, {0x6064, 0}, {0x6061, 0}, {0x60FD, 0}}, false, 3);
  ASSERT_EQ(pdos.size(), 2u);
  EXPECT_EQ(pdos[0].id, 0x183u);
  EXPECT_EQ(pdos[0].size(), 7);
  EXPECT_EQ(pdos[0].fields[1].mapping(), 0x60640020u);
  EXPECT_EQ(pdos[1].id, 0x283u);
  EXPECT_THROW(plan_pdos(eds, {{0x6099, 1}}, true, 3), EdsError);
  EXPECT_THROW(plan_pdos(eds, {{0x6041, 0}}, true, 3), EdsError) << "read-only";
}

}  // namespace
}  // namespace trn
