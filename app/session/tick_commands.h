#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "kernel/rt_messages.h"

namespace trn {

/// What follows an action in an operator's script.
enum class ScriptValue : std::uint8_t { kNone, kPercent, kSwitch };

/// A command to the tick in words.
struct TickCommandRow {
  RtCommand::Kind kind = RtCommand::Kind::kStart;
  /// In a session's log. One that an operator sets has the name of its verb (app/client/command_table.h).
  std::string_view name;
  std::string_view action = "";  ///< in an operator's script; "" if it has none
  ScriptValue value = ScriptValue::kNone;
};

/// Every kind, in its order.
inline constexpr auto kTickCommands = std::to_array<TickCommandRow>({
    {RtCommand::Kind::kStart, "start"},
    {RtCommand::Kind::kHold, "hold", "hold"},
    {RtCommand::Kind::kResume, "resume", "resume"},
    {RtCommand::Kind::kStop, "stop", "stop"},
    {RtCommand::Kind::kOverride, "override", "override", ScriptValue::kPercent},
    {RtCommand::Kind::kJog, "jog"},
    {RtCommand::Kind::kHome, "home"},
    {RtCommand::Kind::kQuickStop, "quick_stop"},
    {RtCommand::Kind::kEmergencyStop, "emergency_stop"},
    {RtCommand::Kind::kCorrection, "correction"},
    {RtCommand::Kind::kResetFault, "reset_fault"},
    {RtCommand::Kind::kRapidOverride, "rapid_override", "rapid", ScriptValue::kPercent},
    {RtCommand::Kind::kSpindleOverride, "spindle_override", "spindle", ScriptValue::kPercent},
    {RtCommand::Kind::kAdaptiveFeed, "adaptive_feed", "adaptive", ScriptValue::kPercent},
    {RtCommand::Kind::kSingleBlock, "single_block", "step", ScriptValue::kSwitch},
    {RtCommand::Kind::kOptionalStop, "optional_stop"},
    {RtCommand::Kind::kMachineLock, "machine_lock"},
    {RtCommand::Kind::kSpindle, "spindle"},
    {RtCommand::Kind::kCoolant, "coolant"},
    {RtCommand::Kind::kDigitalOutput, "digital_output"},
    {RtCommand::Kind::kRetrace, "retrace"},
});

namespace tick_commands {

// A row in a wrong place would be another command in every log.
constexpr bool in_order() {
  for (std::size_t i = 0; i < kTickCommands.size(); ++i)
    if (kTickCommands[i].kind != static_cast<RtCommand::Kind>(i) || kTickCommands[i].name.empty())
      return false;
  return kTickCommands.size() == static_cast<std::size_t>(RtCommand::Kind::kCount);
}
static_assert(in_order());

}  // namespace tick_commands

}  // namespace trn
