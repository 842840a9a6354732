#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/realtime.h"

// The drive profile's state machine and words, CiA 402-2 (IEC 61800-7-201), clause 8.
namespace trn {

enum class Cia402State : std::uint8_t {
  kNotReady,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault
};
std::string_view to_string(Cia402State state);

/// Modes of operation, object 0x6060.
enum class Cia402Mode : std::int8_t {
  kNone = 0,
  kProfilePosition = 1,
  kProfileVelocity = 3,
  kHoming = 6,
  kInterpolatedPosition = 7,
  kCyclicPosition = 8,
  kCyclicVelocity = 9,
  kCyclicTorque = 10
};
std::string_view to_string(Cia402Mode mode);

namespace statusword {
inline constexpr std::uint16_t kVoltage = 1u << 4, kWarning = 1u << 7, kRemote = 1u << 9,
                               kTargetReached = 1u << 10, kInternalLimit = 1u << 11, kBit12 = 1u << 12,
                               kBit13 = 1u << 13;
}
namespace controlword {
inline constexpr std::uint16_t kShutdown = 0x06, kSwitchOn = 0x07, kEnable = 0x0F, kDisableVoltage = 0x00,
                               kQuickStop = 0x02, kFaultReset = 0x80, kBit4 = 1u << 4,
                               kChangeAtOnce = 1u << 5, kHalt = 1u << 8;
}

/// State that a statusword shows (table of 8.4.2); words that no state has are kNotReady.
Cia402State cia402_state(std::uint16_t status) TRN_RT;
/// Bits of a statusword in that state.
std::uint16_t cia402_status_bits(Cia402State state) TRN_RT;
/// The command that leads from `state` one transition on towards Operation Enabled; never resets a fault.
std::uint16_t controlword_towards_enabled(Cia402State state) TRN_RT;

/// "operation enabled, target reached, remote": for people.
std::string describe_statusword(std::uint16_t status);
std::string describe_controlword(std::uint16_t control);

}  // namespace trn
