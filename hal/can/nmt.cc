#include "hal/can/nmt.h"

#include <utility>

#include "core/check.h"

namespace trn {

std::string_view to_string(NmtState state) {
  switch (state) {
    case NmtState::kBootUp:
      return "boot-up";
    case NmtState::kStopped:
      return "stopped";
    case NmtState::kOperational:
      return "operational";
    case NmtState::kPreOperational:
      return "pre-operational";
    case NmtState::kUnknown:
      break;
  }
  return "unknown";
}

std::string_view to_string(NmtCommand command) {
  switch (command) {
    case NmtCommand::kStart:
      return "start";
    case NmtCommand::kStop:
      return "stop";
    case NmtCommand::kPreOperational:
      return "pre-operational";
    case NmtCommand::kResetNode:
      return "reset-node";
    case NmtCommand::kResetCommunication:
      return "reset-communication";
  }
  return "unknown";
}

CanFrame nmt_frame(NmtCommand command, int node) TRN_RT {
  TRN_CHECK(node >= 0 && node <= 127);
  return make_frame(cob::kNmt, {static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(node)});
}

CanFrame heartbeat_frame(int node, NmtState state) TRN_RT {
  TRN_CHECK(node >= 1 && node <= 127);
  return make_frame(cob::kGuard + static_cast<unsigned>(node), {static_cast<std::uint8_t>(state)});
}

CanFrame sync_frame(int counter) TRN_RT {
  TRN_CHECK(counter >= 0 && counter <= 240);
  if (counter == 0) return make_frame(cob::kSync, {});
  return make_frame(cob::kSync, {static_cast<std::uint8_t>(counter)});
}

CanFrame guard_request(int node) TRN_RT {
  CanFrame frame;
  frame.id = cob::kGuard + static_cast<unsigned>(node);
  frame.remote = true;
  frame.size = 1;
  return frame;
}

NmtState nmt_state(std::uint8_t byte) TRN_RT {
  switch (byte & 0x7F) {
    case 0:
      return NmtState::kBootUp;
    case 4:
      return NmtState::kStopped;
    case 5:
      return NmtState::kOperational;
    case 127:
      return NmtState::kPreOperational;
    default:
      return NmtState::kUnknown;
  }
}

std::string_view emergency_text(std::uint16_t code) {
  using Row = std::pair<std::uint16_t, std::string_view>;
  static constexpr Row kCodes[] = {// the most particular first
                                   {0x2310, "continuous over-current"},
                                   {0x3210, "DC link over-voltage"},
                                   {0x3220, "DC link under-voltage"},
                                   {0x4310, "drive too hot"},
                                   {0x7121, "motor blocked"},
                                   {0x7305, "encoder fault"},
                                   {0x8110, "CAN overrun, frames lost"},
                                   {0x8120, "CAN error passive"},
                                   {0x8130, "heartbeat or guarding lost"},
                                   {0x8140, "recovered from bus-off"},
                                   {0x8210, "PDO too short"},
                                   {0x8220, "PDO too long"},
                                   {0x8250, "RPDO did not come in time"},
                                   {0x8611, "following error"},
                                   {0x8612, "reference limit"},
                                   {0x8700, "SYNC did not come in time"}};
  static constexpr Row kClasses[] = {{0x0000, "error reset, or no error"},
                                     {0x1000, "generic error"},
                                     {0x2000, "current"},
                                     {0x3000, "voltage"},
                                     {0x4000, "temperature"},
                                     {0x5000, "hardware of the device"},
                                     {0x6000, "software of the device"},
                                     {0x7000, "additional modules: motor, encoder, brake"},
                                     {0x8000, "monitoring: communication or control"},
                                     {0x9000, "external error"},
                                     {0xF000, "additional functions"}};
  for (const auto& [known, text] : kCodes)
    if (known == code) return text;
  for (const auto& [known, text] : kClasses)
    if (known >> 12 == code >> 12) return text;
  return "of the manufacturer";
}

}  // namespace trn
