#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "app/client/command_rights.h"
#include "hal/lcm_messages.h"

namespace trn {

/// What the daemon does with a command.
enum class CommandAct : std::uint8_t {
  kEvent,    ///< the state of the machine decides: the event of the supervisor that has the verb's name
  kSetting,  ///< handed to the tick in every state: the tick's command that has the verb's name, with its
             ///< value
  kSwitch,   ///< switches something of the programs to come, 1 on, 0 off
  kNote,     ///< changes what is shown or kept, and nothing that moves; its value is a whole number
};

/// When a command makes the machine safer, so that it acts however late, often or early it comes.
enum class MakesSafe : std::uint8_t {
  kNever,
  kAlways,
  kAtZero,  ///< an override of 0
};

/// A verb of command_t, once for all: clients, gateway, panel, daemon, and the operator's script.
struct CommandRow {
  std::int8_t verb = 0;
  std::string_view name;  ///< in logs and refusals; where a blank cannot stand, '_' does
  CommandAct act = CommandAct::kEvent;
  double value_max = 0;  ///< of a setting's value, from 0
  MakesSafe makes_safe = MakesSafe::kNever;
  Role role = Role::kOperate;  ///< that it needs, where it does not make the machine safer
};

/// True for a row's name and the same with '_' for its blanks.
constexpr bool same_name(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if ((a[i] == '_' ? ' ' : a[i]) != (b[i] == '_' ? ' ' : b[i])) return false;
  return true;
}

/// Every verb, by its number.
inline constexpr auto kCommands = std::to_array<CommandRow>({
    {trunnion::command_t::LOAD, "load"},
    {trunnion::command_t::START, "start"},
    {trunnion::command_t::HOLD, "hold", CommandAct::kEvent, 0, MakesSafe::kAlways},
    {trunnion::command_t::RESUME, "resume"},
    {trunnion::command_t::STOP, "stop", CommandAct::kEvent, 0, MakesSafe::kAlways},
    {trunnion::command_t::MDI, "mdi"},
    {trunnion::command_t::JOG, "jog"},
    {trunnion::command_t::HOME, "home"},
    {trunnion::command_t::OVERRIDE, "override", CommandAct::kSetting, 2, MakesSafe::kAtZero},
    {trunnion::command_t::ESTOP, "estop", CommandAct::kEvent, 0, MakesSafe::kAlways},
    {trunnion::command_t::RESET, "reset"},
    {trunnion::command_t::CORRECTION, "correction", CommandAct::kSwitch, 0, MakesSafe::kNever, Role::kSetUp},
    {trunnion::command_t::RAPID_OVERRIDE, "rapid override", CommandAct::kSetting, 1, MakesSafe::kAtZero},
    {trunnion::command_t::SPINDLE_OVERRIDE, "spindle override", CommandAct::kSetting, 2},
    {trunnion::command_t::ADAPTIVE_FEED, "adaptive feed", CommandAct::kSetting, 1, MakesSafe::kAtZero},
    {trunnion::command_t::SINGLE_BLOCK, "single block", CommandAct::kSetting, 1},
    {trunnion::command_t::OPTIONAL_STOP, "optional stop", CommandAct::kSwitch},
    {trunnion::command_t::BLOCK_DELETE, "block delete", CommandAct::kSwitch},
    {trunnion::command_t::ACKNOWLEDGE, "acknowledge", CommandAct::kNote},
    {trunnion::command_t::PARTS, "parts", CommandAct::kNote},
    {trunnion::command_t::DRY_RUN, "dry run", CommandAct::kSwitch},
    {trunnion::command_t::MACHINE_LOCK, "machine lock", CommandAct::kSwitch},
    {trunnion::command_t::DELETE_TOOL, "delete tool", CommandAct::kNote},
});

namespace command_table {

// A row in a wrong place would be another command.
constexpr bool in_order() {
  for (std::size_t i = 0; i < kCommands.size(); ++i)
    if (kCommands[i].verb != trunnion::command_t::LOAD + static_cast<int>(i) || kCommands[i].name.empty() ||
        (kCommands[i].act == CommandAct::kSetting) != (kCommands[i].value_max > 0))
      return false;
  return true;
}
static_assert(in_order());

}  // namespace command_table

/// Null if there is no such verb.
constexpr const CommandRow* find_command(std::int8_t verb) {
  const bool known = verb >= trunnion::command_t::LOAD && verb <= kCommands.back().verb;
  return known ? &kCommands[static_cast<std::size_t>(verb - trunnion::command_t::LOAD)] : nullptr;
}

/// A command may be obeyed this long after it was given, at most. Who holds a longer one back could send it
/// on when nobody thinks of it any more.
inline constexpr double kCommandLifeMax_s = 60;

/// The greatest value of the setting of that name, from 0; 0: there is none.
constexpr double setting_max(std::string_view name) {
  for (const CommandRow& row : kCommands)
    if (same_name(row.name, name)) return row.value_max;
  return 0;
}

/// True for what makes the machine safer: estop, stop, hold, and an override of 0.
bool makes_safe(const trunnion::command_t& command);

/// The role that this very command needs.
Role role_for(const trunnion::command_t& command);

}  // namespace trn
