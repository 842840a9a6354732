#include "sim/modbus/modbus_framing.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace trn {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Examples of the protocol 1.1b3: read coils 20 to 38 (6.1), write two registers from 2 (6.12), three coils
// (6.11); headers as in "Messaging on TCP/IP" 1.0b, 3.1.3.
const Bytes kReadCoils{0x01, 0x00, 0x13, 0x00, 0x13};
const Bytes kWriteRegisters{0x10, 0x00, 0x01, 0x00, 0x02, 0x04, 0x00, 0x0A, 0x01, 0x02};
const Bytes kWriteCoils{0x0F, 0x00, 0x13, 0x00, 0x0A, 0x02, 0xCD, 0x01};

Bytes tcp(std::uint8_t high, std::uint8_t low, std::uint8_t unit, const Bytes& pdu) {
  return Bytes{high, low, 0, 0, 0, static_cast<std::uint8_t>(pdu.size() + 1), unit} + pdu;
}

// CRC by long division of the message, each byte's lowest bit first, by x^16 + x^15 + x^2 + 1: the register
// shifts to the left, as in the definition of the remainder, and is turned round at the end.
std::uint16_t crc_by_division(const Bytes& message) {
  std::uint32_t rest = 0xFFFF;
  for (const std::uint8_t byte : message)
    for (int bit = 0; bit < 8; ++bit) {
      const std::uint32_t top = (rest >> 15 ^ byte >> bit) & 1;
      rest = (rest << 1 & 0xFFFF) ^ (top ? 0x8005 : 0);
    }
  std::uint16_t turned = 0;
  for (int bit = 0; bit < 16; ++bit)
    turned = static_cast<std::uint16_t>(turned | (rest >> bit & 1) << (15 - bit));
  return turned;
}

Bytes rtu(std::uint8_t unit, const Bytes& pdu) {
  const Bytes body = Bytes{unit} + pdu;
  const std::uint16_t crc = crc_by_division(body);
  return body + Bytes{static_cast<std::uint8_t>(crc & 0xFF), static_cast<std::uint8_t>(crc >> 8)};
}

TEST(ModbusCrc, IsThatOfTheStandard) {
  const Bytes standard{0x02, 0x07};  // serial line 1.02, appendix B: 0x1241
  EXPECT_EQ(modbus_crc(standard), 0x1241);
  const std::string_view digits = "123456789";  // the check value of CRC-16/MODBUS in every catalogue
  EXPECT_EQ(modbus_crc(Bytes(digits.begin(), digits.end())), 0x4B37);
  EXPECT_EQ(modbus_crc(Bytes{}), 0xFFFF);
  EXPECT_EQ(modbus_crc(kWriteRegisters), crc_by_division(kWriteRegisters));
}

// Bytes come as the network likes: nothing is taken before the last one, and nothing of the next.
TEST(ModbusFraming, ATcpRequestIsTakenWholeAndAlone) {
  const Bytes first = tcp(0x15, 0x01, 0xFF, kReadCoils), second = tcp(0x15, 0x02, 3, kWriteRegisters);
  const Bytes both = first + second;
  Bytes come;
  std::vector<ModbusRequest> taken;
  for (std::size_t i = 0; i < both.size(); ++i) {
    come.push_back(both[i]);
    const std::optional<ModbusRequest> request = take_tcp_request(come);
    EXPECT_EQ(request.has_value(), i + 1 == first.size() || i + 1 == both.size()) << i;
    if (request) taken.push_back(*request);
  }
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_EQ(taken[0].transaction, 0x1501);
  EXPECT_EQ(taken[0].unit, 255);
  EXPECT_EQ(taken[0].pdu, kReadCoils);
  EXPECT_EQ(taken[1].transaction, 0x1502);
  EXPECT_EQ(taken[1].unit, 3);
  EXPECT_EQ(taken[1].pdu, kWriteRegisters);
  EXPECT_TRUE(come.empty());

  come = both;
  EXPECT_EQ(take_tcp_request(come)->pdu, kReadCoils);
  EXPECT_EQ(come, second);
}

// Protocol identifier 0; the length counts the unit and 1 to 253 bytes of PDU.
TEST(ModbusFraming, AHeaderThatCannotBeIsDropped) {
  const Bytes good = tcp(0, 1, 1, kReadCoils);
  const auto left_of = [&](std::size_t at, std::uint8_t value) {
    Bytes come = good;
    come[at] = value;
    EXPECT_FALSE(take_tcp_request(come));
    return come.size();
  };
  EXPECT_EQ(left_of(2, 1), 0u) << "another protocol";
  EXPECT_EQ(left_of(3, 1), 0u) << "another protocol";
  EXPECT_EQ(left_of(5, 1), 0u) << "no function";
  EXPECT_EQ(left_of(5, 255), 0u) << "longer than a PDU may be";
  EXPECT_EQ(left_of(4, 1), 0u) << "longer than a PDU may be";
  EXPECT_EQ(left_of(5, 254), good.size()) << "the longest one: its other bytes are on their way";
  Bytes shortest{0, 1, 0, 0, 0, 2, 9, 7};
  EXPECT_EQ(take_tcp_request(shortest)->pdu, Bytes{7});
}

TEST(ModbusFraming, ASerialRequestEndsByItsFunction) {
  for (const Bytes& pdu : {kReadCoils, kWriteRegisters, kWriteCoils, Bytes{0x06, 0x00, 0x01, 0x00, 0x03}}) {
    const Bytes frame = rtu(0x11, pdu), next = rtu(0x12, kReadCoils);
    Bytes come;
    for (std::size_t i = 0; i + 1 < frame.size(); ++i) {
      come.push_back(frame[i]);
      EXPECT_FALSE(take_rtu_request(come)) << i;
      EXPECT_EQ(come.size(), i + 1) << "what may yet become a request stays";
    }
    come = come + Bytes{frame.back()} + next;
    const std::optional<ModbusRequest> request = take_rtu_request(come);
    ASSERT_TRUE(request);
    EXPECT_EQ(request->unit, 0x11);
    EXPECT_EQ(request->pdu, pdu);
    EXPECT_EQ(come, next);
  }
}

// After noise, or a frame with a wrong bit, the next good one is found.
TEST(ModbusFraming, ASerialLineRecovers) {
  Bytes broken = rtu(0x11, kWriteCoils);
  broken[5] ^= 0x10;
  Bytes come = Bytes{0x00, 0xFF, 0x63, 0x0E} + broken + rtu(0x11, kReadCoils);
  std::vector<Bytes> taken;
  while (const std::optional<ModbusRequest> request = take_rtu_request(come)) taken.push_back(request->pdu);
  EXPECT_EQ(taken, std::vector<Bytes>{kReadCoils});
}

TEST(ModbusFraming, AnswersGoBackAsTheRequestCame) {
  const ModbusRequest request{0x1501, 0x11, {}};
  const Bytes pdu{0x01, 0x03, 0xCD, 0x6B, 0x05};  // 6.1: coils 20 to 38
  EXPECT_EQ(tcp_answer(request, pdu), tcp(0x15, 0x01, 0x11, pdu));
  EXPECT_EQ(rtu_answer(request, pdu), rtu(0x11, pdu));
  const Bytes longest(253, 0x55);
  EXPECT_EQ(tcp_answer(request, longest)[5], 254);
}

}  // namespace
}  // namespace trn
