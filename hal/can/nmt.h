#pragma once

#include <cstdint>
#include <string_view>

#include "hal/can/frame.h"

// Network management, CiA 301, 7.2.8, and the identifiers of the predefined connection set, 7.3.3.
namespace trn {

inline constexpr int kNodeIdMax = 127;

namespace cob {
inline constexpr std::uint32_t kNmt = 0x000, kSync = 0x080, kEmergency = 0x080, kTpdo1 = 0x180,
                               kRpdo1 = 0x200, kSdoAnswer = 0x580, kSdoRequest = 0x600, kGuard = 0x700;
}

enum class NmtCommand : std::uint8_t {
  kStart = 1,
  kStop = 2,
  kPreOperational = 128,
  kResetNode = 129,
  kResetCommunication = 130
};
/// As a heartbeat or a guarding answer names it.
enum class NmtState : std::uint8_t {
  kBootUp = 0,
  kStopped = 4,
  kOperational = 5,
  kPreOperational = 127,
  kUnknown = 255
};

std::string_view to_string(NmtState state);
std::string_view to_string(NmtCommand command);

/// `node` 0: all nodes.
CanFrame nmt_frame(NmtCommand command, int node) TRN_RT;
CanFrame heartbeat_frame(int node, NmtState state) TRN_RT;
/// SYNC; `counter` 0: without one (CiA 301, 7.2.5).
CanFrame sync_frame(int counter) TRN_RT;
/// Asks a node for its guarding answer (CiA 301, 7.2.8.2.2.2).
CanFrame guard_request(int node) TRN_RT;
/// State from the byte of a heartbeat; the toggle bit of guarding is left out.
NmtState nmt_state(std::uint8_t byte) TRN_RT;

/// What an emergency code says, by its class (CiA 301, 7.2.7, table 26; CiA 402-2, table 5).
std::string_view emergency_text(std::uint16_t code);

}  // namespace trn
