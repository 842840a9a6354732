#include "app/daemon/command_table.h"

#include <array>

namespace trn {

namespace {

using trunnion::command_t;
using Kind = RtCommand::Kind;

constexpr std::array<CommandRow, command_t::SINGLE_BLOCK> kCommands{{
    {command_t::LOAD, "load", Event::kLoad, {}, 0, MakesSafe::kNever},
    {command_t::START, "start", Event::kStart, {}, 0, MakesSafe::kNever},
    {command_t::HOLD, "hold", Event::kHold, {}, 0, MakesSafe::kAlways},
    {command_t::RESUME, "resume", Event::kResume, {}, 0, MakesSafe::kNever},
    {command_t::STOP, "stop", Event::kStop, {}, 0, MakesSafe::kAlways},
    {command_t::MDI, "mdi", Event::kMdi, {}, 0, MakesSafe::kNever},
    {command_t::JOG, "jog", Event::kJog, {}, 0, MakesSafe::kNever},
    {command_t::HOME, "home", Event::kHome, {}, 0, MakesSafe::kNever},
    {command_t::OVERRIDE, "override", {}, Kind::kOverride, 2, MakesSafe::kAtZero},
    {command_t::ESTOP, "estop", Event::kEstop, {}, 0, MakesSafe::kAlways},
    {command_t::RESET, "reset", Event::kReset, {}, 0, MakesSafe::kNever},
    {command_t::CORRECTION, "correction", {}, {}, 0, MakesSafe::kNever, Role::kSetUp},
    {command_t::RAPID_OVERRIDE, "rapid override", {}, Kind::kRapidOverride, 1, MakesSafe::kAtZero},
    {command_t::SPINDLE_OVERRIDE, "spindle override", {}, Kind::kSpindleOverride, 2, MakesSafe::kNever},
    {command_t::ADAPTIVE_FEED, "adaptive feed", {}, Kind::kAdaptiveFeed, 1, MakesSafe::kAtZero},
    {command_t::SINGLE_BLOCK, "single block", {}, Kind::kSingleBlock, 1, MakesSafe::kNever},
}};

// A row in a wrong place would be another command; one that says nothing would be acknowledged and do
// nothing.
constexpr bool complete() {
  for (std::size_t i = 0; i < kCommands.size(); ++i) {
    const CommandRow& row = kCommands[i];
    if (row.verb != command_t::LOAD + static_cast<int>(i) || row.name.empty()) return false;
    const bool acts = row.event.has_value() != row.setting.has_value();
    if (!acts && row.verb != command_t::CORRECTION) return false;
    if (row.setting && !(row.setting_max > 0)) return false;
  }
  return true;
}
static_assert(complete());

}  // namespace

const CommandRow* find_command(std::int8_t verb) {
  const bool known = verb >= command_t::LOAD && verb <= command_t::SINGLE_BLOCK;
  return known ? &kCommands[static_cast<std::size_t>(verb - command_t::LOAD)] : nullptr;
}

bool makes_safe(const command_t& command) {
  const CommandRow* row = find_command(command.verb);
  if (!row || row->makes_safe == MakesSafe::kNever) return false;
  return row->makes_safe == MakesSafe::kAlways || command.value == 0;
}

}  // namespace trn
