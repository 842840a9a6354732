#include "app/daemon/command_effect.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "app/client/command_table.h"
#include "app/daemon/held_jogs.h"
#include "app/session/tick_commands.h"
#include "core/check.h"

namespace trn {

namespace {

using trunnion::command_t;

constexpr std::optional<Event> event_called(std::string_view name) {
  for (std::size_t i = 0; i < kCommandEvents; ++i)
    if (same_name(kEventNames[i], name)) return static_cast<Event>(i);
  return std::nullopt;
}

constexpr std::optional<RtCommand::Kind> tick_command_called(std::string_view name) {
  for (const TickCommandRow& row : kTickCommands)
    if (same_name(row.name, name)) return row.kind;
  return std::nullopt;
}

constexpr auto kEffects = [] {
  std::array<CommandEffect, kCommands.size()> effects{};
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (kCommands[i].act == CommandAct::kEvent) effects[i].event = event_called(kCommands[i].name);
    if (kCommands[i].act == CommandAct::kSetting) effects[i].setting = tick_command_called(kCommands[i].name);
  }
  return effects;
}();

// A verb without effect would be acknowledged and do nothing.
constexpr bool complete() {
  for (std::size_t i = 0; i < kEffects.size(); ++i) {
    if (kCommands[i].act == CommandAct::kEvent && !kEffects[i].event) return false;
    if (kCommands[i].act == CommandAct::kSetting && !kEffects[i].setting) return false;
  }
  return true;
}
static_assert(complete());

}  // namespace

CommandEffect effect_of(std::int8_t verb) {
  const CommandRow* row = find_command(verb);
  TRN_CHECK(row != nullptr);
  return kEffects[static_cast<std::size_t>(row - kCommands.data())];
}

std::string bad_values(const command_t& command, int joints) {
  const bool all_joints = command.verb == command_t::HOME && command.joint == -1;
  const CommandRow* row = find_command(command.verb);
  if (!row) return fmt::format("verb {} is not known", command.verb);
  if (!all_joints && (command.joint < 0 || command.joint >= joints))
    return fmt::format("joint {} does not exist; joints are 0 to {}", command.joint, joints - 1);
  if (!std::isfinite(command.value) || !std::isfinite(command.speed) || command.speed < 0)
    return "value and speed must be finite, and speed not negative";
  if (command.verb == command_t::LOAD && command.value < 0 && command.value != -1)
    return fmt::format("line {} is none: 1 or more, or -1 for the recorded place", command.value);
  if (!(command.speed_share >= 0 && command.speed_share <= 1))
    return fmt::format("speed_share {} is out of range: 0 to 1 is legal", command.speed_share);
  if (row->act == CommandAct::kNote &&
      !(command.value >= 0 && command.value <= 1e9 && std::floor(command.value) == command.value))
    return fmt::format("{} is no number: 0, 1, 2, ... is legal", command.value);
  if (command.frame < 0 || command.frame > command_t::PATH ||
      (command.frame && command.verb != command_t::JOG))
    return fmt::format("frame {} is not known: a jog takes 0 to {}", command.frame, +command_t::PATH);
  if (command.frame == command_t::PATH && command.alive_ms != 0)
    return "a jog along the path takes alive_ms 0: 'hold' stops it";
  if (command.alive_ms != 0 && (command.verb != command_t::JOG || !HeldJogs::legal(command.alive_ms)))
    return fmt::format("alive_ms {} is out of range: {}", command.alive_ms, HeldJogs::kLegal);
  return "";
}

}  // namespace trn
