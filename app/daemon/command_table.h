#pragma once

#include <optional>
#include <string_view>

#include "app/daemon/access.h"
#include "app/daemon/supervisor.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"

namespace trn {

/// When a command makes the machine safer, so that it acts however late, often or early it comes.
enum class MakesSafe : std::uint8_t {
  kNever,
  kAlways,
  kAtZero,  ///< an override of 0
};

/// Everything about a verb of command_t that does not hang on the command's own values.
struct CommandRow {
  std::int8_t verb = 0;
  std::string_view name;                   ///< in the daemon's log and in refusals
  std::optional<Event> event;              ///< what the supervisor decides on; none: legal in every state
  std::optional<RtCommand::Kind> setting;  ///< passed on to the tick with the command's value
  double setting_max = 0;                  ///< of the value, from 0
  MakesSafe makes_safe = MakesSafe::kNever;
  Role role = Role::kOperate;  ///< that it needs, where it does not make the machine safer
};

/// Null if there is no such verb.
const CommandRow* find_command(std::int8_t verb);

/// True for what makes the machine safer: estop, stop, hold, and an override of 0.
bool makes_safe(const trunnion::command_t& command);

}  // namespace trn
