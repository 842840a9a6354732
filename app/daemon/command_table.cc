#include "app/daemon/command_table.h"

#include <array>

namespace trn {

namespace {

using trunnion::command_t;
constexpr std::array<CommandRow, command_t::SINGLE_BLOCK> kCommands{{
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
}};

// A row in a wrong place would be another command; one that says nothing would be acknowledged and do
// nothing.
constexpr bool complete() {
  for (std::size_t i = 0; i < kCommands.size(); ++i) {
    const CommandRow& row = kCommands[i];
    if (row.verb != command_t::LOAD + static_cast<int>(i)) return false;
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

}  // namespace trn
