#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/daemon/access.h"
#include "app/daemon/supervisor.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What the daemon does with a verb of command_t. Who may give it: CommandRights.
struct CommandRow {
  std::int8_t verb = 0;
  std::optional<Event> event;              ///< what the supervisor decides on; none: legal in every state
  std::optional<RtCommand::Kind> setting;  ///< passed on to the tick with the command's value
  double setting_max = 0;                  ///< of the value, from 0
};

/// Changes what is shown, and nothing that moves: ACKNOWLEDGE and PARTS.
constexpr bool is_note(std::int8_t verb) {
  return verb == trunnion::command_t::ACKNOWLEDGE || verb == trunnion::command_t::PARTS;
}

/// Null if there is no such verb.
const CommandRow* find_command(std::int8_t verb);
/// What of the command is out of any range, on a machine with so many joints; "": nothing.
std::string bad_values(const trunnion::command_t& command, int joints);

}  // namespace trn
