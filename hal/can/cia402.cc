#include "hal/can/cia402.h"

#include <iterator>
#include <utility>

namespace trn {

std::string_view to_string(Cia402State state) {
  static constexpr std::string_view kNames[] = {
      "not ready to switch on", "switch on disabled", "ready to switch on",    "switched on",
      "operation enabled",      "quick stop active",  "fault reaction active", "fault"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Cia402State::kFault) + 1);
  return kNames[static_cast<std::size_t>(state)];
}

std::string_view to_string(Cia402Mode mode) {
  switch (mode) {
    case Cia402Mode::kNone:
      return "no mode";
    case Cia402Mode::kProfilePosition:
      return "profile position";
    case Cia402Mode::kProfileVelocity:
      return "profile velocity";
    case Cia402Mode::kHoming:
      return "homing";
    case Cia402Mode::kInterpolatedPosition:
      return "interpolated position";
    case Cia402Mode::kCyclicPosition:
      return "cyclic synchronous position";
    case Cia402Mode::kCyclicVelocity:
      return "cyclic synchronous velocity";
    case Cia402Mode::kCyclicTorque:
      return "cyclic synchronous torque";
  }
  return "unknown mode";
}

Cia402State cia402_state(std::uint16_t status) TRN_RT {
  // The masks of CiA 402-2: bit 5 (quick stop) says nothing in the three states of the mask 0x4F and tells
  // Operation Enabled from Quick Stop Active in the others.
  const unsigned with_quick_stop = status & 0x6Fu, without = status & 0x4Fu;
  if (without == 0x40) return Cia402State::kSwitchOnDisabled;
  if (without == 0x0F) return Cia402State::kFaultReactionActive;
  if (without == 0x08) return Cia402State::kFault;
  if (with_quick_stop == 0x21) return Cia402State::kReadyToSwitchOn;
  if (with_quick_stop == 0x23) return Cia402State::kSwitchedOn;
  if (with_quick_stop == 0x27) return Cia402State::kOperationEnabled;
  if (with_quick_stop == 0x07) return Cia402State::kQuickStopActive;
  return Cia402State::kNotReady;
}

std::uint16_t cia402_status_bits(Cia402State state) TRN_RT {
  switch (state) {
    case Cia402State::kNotReady:
      return 0x00;
    case Cia402State::kSwitchOnDisabled:
      return 0x40;
    case Cia402State::kReadyToSwitchOn:
      return 0x21;
    case Cia402State::kSwitchedOn:
      return 0x23;
    case Cia402State::kOperationEnabled:
      return 0x27;
    case Cia402State::kQuickStopActive:
      return 0x07;
    case Cia402State::kFaultReactionActive:
      return 0x0F;
    case Cia402State::kFault:
      return 0x08;
  }
  return 0;
}

std::uint16_t controlword_towards_enabled(Cia402State state) TRN_RT {
  switch (state) {
    case Cia402State::kSwitchOnDisabled:
      return controlword::kShutdown;
    case Cia402State::kReadyToSwitchOn:
      return controlword::kSwitchOn;
    case Cia402State::kSwitchedOn:
    case Cia402State::kOperationEnabled:
      return controlword::kEnable;
    // Not ready, quick stop active and the states of a fault: nothing leads on from there but Disable Voltage
    // or waiting. A reset of a fault has its own edge (`Cia402Axis::step_fault`).
    default:
      return controlword::kDisableVoltage;
  }
}

std::string describe_statusword(std::uint16_t status) {
  static constexpr std::pair<std::uint16_t, std::string_view> kBits[] = {
      {statusword::kVoltage, "voltage enabled"},
      {statusword::kWarning, "warning"},
      {statusword::kRemote, "remote"},
      {statusword::kTargetReached, "target reached"},
      {statusword::kInternalLimit, "internal limit"},
      {statusword::kBit12, "bit 12 (follows, homed, acknowledged)"},
      {statusword::kBit13, "bit 13 (following or homing error)"}};
  std::string text(to_string(cia402_state(status)));
  for (const auto& [bit, name] : kBits)
    if (status & bit) text += ", " + std::string(name);
  return text;
}

std::string describe_controlword(std::uint16_t control) {
  std::string text;
  // In the order in which a drive judges them: reset before all else, then the bits whose 0 switches off,
  // voltage first.
  if (control & controlword::kFaultReset)
    text = "fault reset";
  else if (!(control & 0x02))
    text = "disable voltage";
  else if (!(control & 0x04))
    text = "quick stop";
  else if (!(control & 0x01))
    text = "shutdown";
  else
    text = control & 0x08 ? "enable operation" : "switch on";
  if (control & controlword::kBit4) text += ", bit 4 (start, new setpoint, enable interpolation)";
  if (control & controlword::kChangeAtOnce) text += ", change at once";
  if (control & controlword::kHalt) text += ", halt";
  return text;
}

}  // namespace trn
