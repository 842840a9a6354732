#include "app/client/command_rights.h"

#include <array>
#include <cstddef>

namespace trn {

namespace {

using trunnion::command_t;

constexpr std::array<std::string_view, static_cast<std::size_t>(Role::kCount)> kRoles{"look", "operate",
                                                                                      "set up"};
static_assert(!kRoles.back().empty());  // a row for each

constexpr std::array<CommandRights, command_t::MACHINE_LOCK> kRights{{
    {command_t::LOAD, "load"},
    {command_t::START, "start"},
    {command_t::HOLD, "hold", MakesSafe::kAlways},
    {command_t::RESUME, "resume"},
    {command_t::STOP, "stop", MakesSafe::kAlways},
    {command_t::MDI, "mdi"},
    {command_t::JOG, "jog"},
    {command_t::HOME, "home"},
    {command_t::OVERRIDE, "override", MakesSafe::kAtZero},
    {command_t::ESTOP, "estop", MakesSafe::kAlways},
    {command_t::RESET, "reset"},
    {command_t::CORRECTION, "correction", MakesSafe::kNever, Role::kSetUp},
    {command_t::RAPID_OVERRIDE, "rapid override", MakesSafe::kAtZero},
    {command_t::SPINDLE_OVERRIDE, "spindle override"},
    {command_t::ADAPTIVE_FEED, "adaptive feed", MakesSafe::kAtZero},
    {command_t::SINGLE_BLOCK, "single block"},
    {command_t::OPTIONAL_STOP, "optional stop"},
    {command_t::BLOCK_DELETE, "block delete"},
    {command_t::ACKNOWLEDGE, "acknowledge"},
    {command_t::PARTS, "parts"},
    {command_t::DRY_RUN, "dry run"},
    {command_t::MACHINE_LOCK, "machine lock"},
}};

// A row in a wrong place would be another command.
constexpr bool complete() {
  for (std::size_t i = 0; i < kRights.size(); ++i)
    if (kRights[i].verb != command_t::LOAD + static_cast<int>(i) || kRights[i].name.empty()) return false;
  return true;
}
static_assert(complete());

}  // namespace

std::string_view to_string(Role role) { return kRoles[static_cast<std::size_t>(role)]; }

std::optional<Role> role_called(std::string_view name) {
  for (std::size_t i = 0; i < kRoles.size(); ++i)
    if (kRoles[i] == name) return static_cast<Role>(i);
  return std::nullopt;
}

const CommandRights* find_rights(std::int8_t verb) {
  const bool known = verb >= command_t::LOAD && verb <= command_t::MACHINE_LOCK;
  return known ? &kRights[static_cast<std::size_t>(verb - command_t::LOAD)] : nullptr;
}

bool makes_safe(const command_t& command) {
  const CommandRights* rights = find_rights(command.verb);
  if (!rights || rights->makes_safe == MakesSafe::kNever) return false;
  return rights->makes_safe == MakesSafe::kAlways || command.value == 0;
}

Role role_for(const command_t& command) {
  if (makes_safe(command)) return Role::kLook;
  const CommandRights* rights = find_rights(command.verb);
  return rights ? rights->role : Role::kOperate;
}

}  // namespace trn
