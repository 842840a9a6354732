#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/lcm_messages.h"

namespace trn {

/// What somebody may do. Each role may do what those before it may.
enum class Role : std::uint8_t {
  kLook,     ///< see state and motion; stop the machine
  kOperate,  ///< move it: programs, MDI, jog, home, overrides, reset, sensor readings
  kSetUp,    ///< change how it moves: switch corrections
  kCount
};
std::string_view to_string(Role role);
/// The reverse; nothing if no role is called so.
std::optional<Role> role_called(std::string_view name);

/// When a command makes the machine safer, so that it acts however late, often or early it comes.
enum class MakesSafe : std::uint8_t {
  kNever,
  kAlways,
  kAtZero,  ///< an override of 0
};

/// Who may give a command, and when it always gets through.
struct CommandRights {
  std::int8_t verb = 0;   ///< of command_t
  std::string_view name;  ///< in logs and in refusals
  MakesSafe makes_safe = MakesSafe::kNever;
  Role role = Role::kOperate;  ///< that it needs, where it does not make the machine safer
};

/// Null if there is no such verb.
const CommandRights* find_rights(std::int8_t verb);

/// True for what makes the machine safer: estop, stop, hold, and an override of 0.
bool makes_safe(const trunnion::command_t& command);

/// The role that this very command needs.
Role role_for(const trunnion::command_t& command);

}  // namespace trn
