#include "app/daemon/command_table.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "app/daemon/held_jogs.h"
#include "app/daemon/switches.h"

namespace trn {

namespace {

using trunnion::command_t;
constexpr std::array<CommandRow, command_t::MACHINE_LOCK> kCommands{{
    {command_t::LOAD, Event::kLoad, {}, 0},
    {command_t::START, Event::kStart, {}, 0},
    {command_t::HOLD, Event::kHold, {}, 0},
    {command_t::RESUME, Event::kResume, {}, 0},
    {command_t::STOP, Event::kStop, {}, 0},
    {command_t::MDI, Event::kMdi, {}, 0},
    {command_t::JOG, Event::kJog, {}, 0},
    {command_t::HOME, Event::kHome, {}, 0},
    {command_t::OVERRIDE, {}, RtCommand::Kind::kOverride, 2},
    {command_t::ESTOP, Event::kEstop, {}, 0},
    {command_t::RESET, Event::kReset, {}, 0},
    {command_t::CORRECTION, {}, {}, 0},
    {command_t::RAPID_OVERRIDE, {}, RtCommand::Kind::kRapidOverride, 1},
    {command_t::SPINDLE_OVERRIDE, {}, RtCommand::Kind::kSpindleOverride, 2},
    {command_t::ADAPTIVE_FEED, {}, RtCommand::Kind::kAdaptiveFeed, 1},
    {command_t::SINGLE_BLOCK, {}, RtCommand::Kind::kSingleBlock, 1},
    {command_t::OPTIONAL_STOP, {}, {}, 0},
    {command_t::BLOCK_DELETE, {}, {}, 0},
    {command_t::ACKNOWLEDGE, {}, {}, 0},
    {command_t::PARTS, {}, {}, 0},
    {command_t::DRY_RUN, {}, {}, 0},
    {command_t::MACHINE_LOCK, {}, {}, 0},
}};

// A row in a wrong place would be another command; one that says nothing would be acknowledged and do
// nothing.
constexpr bool complete() {
  for (std::size_t i = 0; i < kCommands.size(); ++i) {
    const CommandRow& row = kCommands[i];
    if (row.verb != command_t::LOAD + static_cast<int>(i)) return false;
    const bool acts = row.event.has_value() != row.setting.has_value();
    if (!acts && !is_switch(row.verb) && !is_note(row.verb)) return false;
    if (row.setting && !(row.setting_max > 0)) return false;
  }
  return true;
}
static_assert(complete());

}  // namespace

const CommandRow* find_command(std::int8_t verb) {
  const bool known = verb >= command_t::LOAD && verb <= command_t::MACHINE_LOCK;
  return known ? &kCommands[static_cast<std::size_t>(verb - command_t::LOAD)] : nullptr;
}

std::string bad_values(const command_t& command, int joints) {
  const bool all_joints = command.verb == command_t::HOME && command.joint == -1;
  if (!find_command(command.verb)) return fmt::format("verb {} is not known", command.verb);
  if (!all_joints && (command.joint < 0 || command.joint >= joints))
    return fmt::format("joint {} does not exist; joints are 0 to {}", command.joint, joints - 1);
  if (!std::isfinite(command.value) || !std::isfinite(command.speed) || command.speed < 0)
    return "value and speed must be finite, and speed not negative";
  if (command.verb == command_t::LOAD && command.value < 0 && command.value != -1)
    return fmt::format("line {} is none: 1 or more, or -1 for the recorded place", command.value);
  if (!(command.speed_share >= 0 && command.speed_share <= 1))
    return fmt::format("speed_share {} is out of range: 0 to 1 is legal", command.speed_share);
  if (is_note(command.verb) &&
      !(command.value >= 0 && command.value <= 1e9 && std::floor(command.value) == command.value))
    return fmt::format("{} is no number: 0, 1, 2, ... is legal", command.value);
  if (command.frame < 0 || command.frame > command_t::PATH ||
      (command.frame && command.verb != command_t::JOG))
    return fmt::format("frame {} is not known: a jog takes 0 to {}", command.frame, command_t::PATH);
  if (command.frame == command_t::PATH && command.alive_ms != 0)
    return "a jog along the path takes alive_ms 0: 'hold' stops it";
  if (command.alive_ms != 0 && (command.verb != command_t::JOG || !HeldJogs::legal(command.alive_ms)))
    return fmt::format("alive_ms {} is out of range: {}", command.alive_ms, HeldJogs::kLegal);
  return "";
}

}  // namespace trn
