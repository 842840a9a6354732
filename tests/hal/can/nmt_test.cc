#include "hal/can/nmt.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string_view>
#include <utility>

// Numbers of CiA 301: commands of table 37, states of table 35, emergency classes of table 26.
namespace trn {
namespace {

TEST(Nmt, FramesAreThoseOfTheStandard) {
  const CanFrame start = nmt_frame(NmtCommand::kStart, 5), all = nmt_frame(NmtCommand::kResetNode, 0);
  EXPECT_EQ(to_string(start), "000#01 05");
  EXPECT_EQ(to_string(all), "000#81 00");
  EXPECT_EQ(to_string(nmt_frame(NmtCommand::kPreOperational, 127)), "000#80 7F");
  EXPECT_EQ(to_string(heartbeat_frame(127, NmtState::kOperational)), "77F#05");
  EXPECT_EQ(sync_frame(0).size, 0);
  EXPECT_EQ(to_string(sync_frame(240)), "080#F0");
  const CanFrame guard = guard_request(5);
  EXPECT_EQ(guard.id, 0x705u);
  EXPECT_TRUE(guard.remote);
  EXPECT_EQ(guard.size, 1);
}

TEST(Nmt, StatesWithAndWithoutTheToggleBit) {
  const std::pair<int, NmtState> rows[] = {{0, NmtState::kBootUp},      {4, NmtState::kStopped},
                                           {5, NmtState::kOperational}, {127, NmtState::kPreOperational},
                                           {3, NmtState::kUnknown},     {6, NmtState::kUnknown}};
  for (const auto& [byte, state] : rows) {
    EXPECT_EQ(nmt_state(static_cast<std::uint8_t>(byte)), state) << byte;
    EXPECT_EQ(nmt_state(static_cast<std::uint8_t>(byte | 0x80)), state) << byte << " toggled";
  }
}

TEST(Nmt, AnEmergencyHasTheTextOfItsCodeElseOfItsClass) {
  const std::pair<std::uint16_t, std::string_view> rows[] = {
      {0x0000, "error reset, or no error"},
      {0x1001, "generic error"},
      {0x2310, "continuous over-current"},
      {0x2311, "current"},
      {0x3210, "DC link over-voltage"},
      {0x3FFF, "voltage"},
      {0x4210, "temperature"},
      {0x5000, "hardware of the device"},
      {0x6320, "software of the device"},
      {0x7500, "additional modules: motor, encoder, brake"},
      {0x8100, "monitoring: communication or control"},
      {0x9000, "external error"},
      {0xA000, "of the manufacturer"},
      {0xE000, "of the manufacturer"},
      {0xF001, "additional functions"}};
  for (const auto& [code, text] : rows) EXPECT_EQ(emergency_text(code), text) << std::hex << code;
}

}  // namespace
}  // namespace trn
