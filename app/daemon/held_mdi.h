#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernel/rt_messages.h"

namespace trn {

/// Where a program is held.
enum class HeldAt {
  kPath,        ///< what follows is planned already
  kStop,        ///< at M0 or M1: nothing behind it is read
  kToolChange,  ///< at M6, whose tool is not confirmed yet: the same
};

/// A line of MDI while a program is held: what of it acts at once.
struct HeldMdi {
  std::vector<RtCommand> commands;  ///< for the tick, in order
  std::string lines;                ///< instead: for ProgramSource::obey_held
  std::string refusal;              ///< then nothing of the line acts
};

/// Spindle (M3, M4, M5, S), coolant (M7, M8, M9) and digital outputs (M64, M65, P), with plain numbers.
/// Where nothing behind the place is read, also offsets, tool lengths and the tool in the spindle (G10, M61;
/// G43 behind them says no more than that). Everything else would change what the held program goes on with,
/// and is refused with the reason. `program_speed`: the S that the program has set, rpm; `coolant`: bits that
/// are on, 1 mist, 2 flood.
HeldMdi plan_held_mdi(std::string_view text, double program_speed, int coolant, HeldAt at);

}  // namespace trn
