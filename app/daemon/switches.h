#pragma once

#include <optional>
#include <string>

#include "app/session/pipeline.h"
#include "hal/lcm_messages.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// What a command that switches something asks for.
struct SwitchOrder {
  std::string name;                  ///< of the switch, for people
  ProgramSwitches programs;          ///< for the programs from now on
  bool changes_plan = false;         ///< what is prepared must be prepared anew
  bool changes_reading = false;      ///< of the program that is under way: for what is not read yet
  std::optional<RtCommand> command;  ///< for the tick
  std::string refusal;               ///< then nothing shall be switched
};

/// `command`: a kSwitch of the table of commands; `now`: as it is; `idle`: nothing moves, and nothing is
/// being prepared. Corrections behind the plan fade in and out at any time, and M1 is passed at any time;
/// what is part of the plan would make a plan wrong that is being driven. `map` and `chain` may be null: no
/// corrections.
SwitchOrder plan_switch(const trunnion::command_t& command, const ProgramSwitches& now, bool idle,
                        const MachineJointMap* map, const SetpointChain* chain);

}  // namespace trn
