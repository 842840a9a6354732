#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "app/daemon/supervisor.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What a verb's row in the table of commands (app/client/command_table.h) means to the daemon. Both are
/// found by the row's name, while this is compiled.
struct CommandEffect {
  std::optional<Event> event;              ///< of a kEvent: what the supervisor decides on
  std::optional<RtCommand::Kind> setting;  ///< of a kSetting: what the tick is told, with the command's value
};

/// `verb`: one that has a row.
CommandEffect effect_of(std::int8_t verb);
/// What of the command is out of any range, on a machine with so many joints; "": nothing.
std::string bad_values(const trunnion::command_t& command, int joints);

}  // namespace trn
