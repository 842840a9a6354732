#include "app/daemon/supervisor.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <vector>

#include "core/check.h"

namespace trn {

namespace {

using S = MachineState;
using E = Event;

constexpr std::uint32_t kDoAbandon = kDoStopOnPath | kDoDropProgram;
constexpr std::uint32_t kDoEmergency = kDoQuickStop | kDoDropProgram;

constexpr auto kTable = std::to_array<Transition>({
    {S::kOff, E::kReset, S::kStarting, kDoBringUp},
    {S::kOff, E::kEstop, S::kEstop, kDoQuickStop},
    {S::kOff, E::kTerminate, S::kClosing, kDoNothing},  // behind a stop of homing, drives may still brake
    {S::kOff, E::kQuickFault, S::kFault, kDoNothing},

    {S::kStarting, E::kDrivesReady, S::kIdle, kDoNothing},
    {S::kStarting, E::kStartFailed, S::kFault, kDoQuickStop},
    {S::kStarting, E::kEstop, S::kEstop, kDoQuickStop},
    {S::kStarting, E::kTerminate, S::kClosing, kDoNothing},
    {S::kStarting, E::kPathFault, S::kFault, kDoNothing},
    {S::kStarting, E::kQuickFault, S::kFault, kDoQuickStop},

    {S::kIdle, E::kLoad, S::kIdle, kDoLoad},
    {S::kIdle, E::kStart, S::kRunning, kDoStart},
    {S::kIdle, E::kMdi, S::kRunning, kDoMdi},
    {S::kIdle, E::kJog, S::kJogging, kDoJog},
    {S::kIdle, E::kHome, S::kHoming, kDoHome},
    {S::kIdle, E::kStop, S::kIdle, kDoDropProgram},
    {S::kIdle, E::kReset, S::kIdle, kDoNothing},
    {S::kIdle, E::kEstop, S::kEstop, kDoEmergency},
    {S::kIdle, E::kTerminate, S::kClosing, kDoDropProgram},
    {S::kIdle, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kIdle, E::kPathFault, S::kFault, kDoDropProgram},
    {S::kIdle, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kRunning, E::kHold, S::kHolding, kDoHold},
    {S::kRunning, E::kResume, S::kRunning, kDoNothing},
    {S::kRunning, E::kStop, S::kStopping, kDoAbandon},
    {S::kRunning, E::kMotionDone, S::kIdle, kDoNothing},
    {S::kRunning, E::kPaused, S::kHolding, kDoNothing},
    {S::kRunning, E::kEstop, S::kEstop, kDoEmergency},
    {S::kRunning, E::kTerminate, S::kClosing, kDoAbandon},
    {S::kRunning, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kRunning, E::kPathFault, S::kFault, kDoAbandon},
    {S::kRunning, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kHolding, E::kHold, S::kHolding, kDoHold},
    {S::kHolding, E::kResume, S::kRunning, kDoResume},
    {S::kHolding, E::kStart, S::kRunning, kDoResume},
    {S::kHolding, E::kMdi, S::kHolding, kDoMdi},
    {S::kHolding, E::kJog, S::kHolding, kDoJog},
    {S::kHolding, E::kStop, S::kStopping, kDoAbandon},
    {S::kHolding, E::kMotionDone, S::kIdle, kDoNothing},
    {S::kHolding, E::kEstop, S::kEstop, kDoEmergency},
    {S::kHolding, E::kTerminate, S::kClosing, kDoAbandon},
    {S::kHolding, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kHolding, E::kPathFault, S::kFault, kDoAbandon},
    {S::kHolding, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kStopping, E::kStop, S::kStopping, kDoNothing},
    {S::kStopping, E::kHold, S::kStopping, kDoNothing},
    {S::kStopping, E::kMotionDone, S::kIdle, kDoNothing},
    {S::kStopping, E::kEstop, S::kEstop, kDoEmergency},
    {S::kStopping, E::kTerminate, S::kClosing, kDoNothing},
    {S::kStopping, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kStopping, E::kPathFault, S::kFault, kDoNothing},
    {S::kStopping, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kJogging, E::kJog, S::kJogging, kDoJog},
    {S::kJogging, E::kStop, S::kStopping, kDoStopOnPath},
    {S::kJogging, E::kHold, S::kStopping, kDoStopOnPath},
    {S::kJogging, E::kMotionDone, S::kIdle, kDoNothing},
    {S::kJogging, E::kEstop, S::kEstop, kDoEmergency},
    {S::kJogging, E::kTerminate, S::kClosing, kDoAbandon},
    {S::kJogging, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kJogging, E::kPathFault, S::kFault, kDoAbandon},
    {S::kJogging, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kHoming, E::kMotionDone, S::kIdle, kDoNothing},
    {S::kHoming, E::kStop, S::kOff, kDoQuickStop},
    {S::kHoming, E::kEstop, S::kEstop, kDoEmergency},
    {S::kHoming, E::kTerminate, S::kClosing, kDoQuickStop},
    {S::kHoming, E::kDrivesOff, S::kFault, kDoEmergency},
    {S::kHoming, E::kPathFault, S::kFault, kDoQuickStop},
    {S::kHoming, E::kQuickFault, S::kFault, kDoEmergency},

    {S::kFault, E::kReset, S::kStarting, kDoResetFaults | kDoBringUp},
    {S::kFault, E::kStop, S::kFault, kDoNothing},
    {S::kFault, E::kEstop, S::kEstop, kDoEmergency},
    {S::kFault, E::kTerminate, S::kClosing, kDoNothing},
    {S::kFault, E::kQuickFault, S::kFault, kDoQuickStop},

    {S::kEstop, E::kReset, S::kStarting, kDoResetFaults | kDoBringUp},
    {S::kEstop, E::kStop, S::kEstop, kDoNothing},
    {S::kEstop, E::kEstop, S::kEstop, kDoQuickStop},
    {S::kEstop, E::kTerminate, S::kClosing, kDoNothing},

    {S::kClosing, E::kMotionDone, S::kClosing, kDoShutDown},
    {S::kClosing, E::kDrivesOff, S::kOff, kDoExit},
    {S::kClosing, E::kTimeout, S::kOff, kDoQuickStop | kDoShutDown | kDoExit},
    {S::kClosing, E::kEstop, S::kClosing, kDoQuickStop},
    {S::kClosing, E::kTerminate, S::kClosing, kDoNothing},
    {S::kClosing, E::kPathFault, S::kClosing, kDoNothing},
    {S::kClosing, E::kQuickFault, S::kClosing, kDoQuickStop},
});

const Transition* find(S from, E event) {
  for (const Transition& row : kTable)
    if (row.from == from && row.event == event) return &row;
  return nullptr;
}

std::string refuse_by_state(S state, E event, std::string_view command) {
  std::vector<std::string_view> legal;
  for (const Transition& row : kTable)
    if (row.event == event) legal.push_back(to_string(row.from));
  std::string help;
  if (state == S::kFault || state == S::kEstop) help = "; clear it with 'reset'";
  if (state == S::kOff) help = "; bring the drives up with 'reset'";
  if (state == S::kHolding) help = "; 'resume' or 'start' goes on, 'stop' gives the program up";
  const bool held = std::find(legal.begin(), legal.end(), to_string(S::kHolding)) != legal.end();
  if (state == S::kRunning) help = held ? "; 'hold' or 'stop' it first" : "; 'stop' ends what runs";
  if (state == S::kJogging || state == S::kHoming) help = "; wait for its end, or 'stop' it";
  return fmt::format("the machine is in state '{}'; '{}' is legal in: {}{}", to_string(state), command,
                     fmt::join(legal, ", "), help);
}

std::string refuse_by_conditions(S state, E event, const Conditions& conditions, std::string_view command) {
  const bool needs_stand = state == S::kHolding && (event == E::kJog || event == E::kMdi);
  if (needs_stand && !conditions.stands_in_hold)
    return fmt::format(
        "the machine is in state '{}', but does not stand yet, or stands in a thread or a probe move; "
        "'{}' is obeyed when it stands on its path",
        to_string(state), command);
  if (event == E::kStart && !conditions.program_loaded) return "no program is loaded; 'load' one first";
  if ((event == E::kStart || event == E::kMdi) && !conditions.homed)
    return "not every joint knows its position; 'home' the machine first";
  return "";
}

}  // namespace

std::string_view to_string(MachineState state) {
  TRN_CHECK(state < MachineState::kCount);
  static constexpr std::string_view kNames[] = {"off",     "starting", "idle",    "running",
                                                "holding", "stopping", "jogging", "homing",
                                                "fault",   "estop",    "closing"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(MachineState::kCount));
  return kNames[static_cast<std::size_t>(state)];
}

std::string_view to_string(Event event) {
  TRN_CHECK(event < Event::kCount);
  return kEventNames[static_cast<std::size_t>(event)];
}

std::span<const Transition> Supervisor::table() { return kTable; }

Decision Supervisor::handle(Event event, const Conditions& conditions) {
  return handle(event, conditions, to_string(event));
}

Decision Supervisor::handle(Event event, const Conditions& conditions, std::string_view command) {
  TRN_CHECK(event < Event::kCount);
  const bool told = static_cast<int>(event) < kCommandEvents;
  const Transition* row = find(state_, event);
  if (!row) return {kDoNothing, told ? refuse_by_state(state_, event, command) : ""};
  const std::string refusal = refuse_by_conditions(state_, event, conditions, command);
  if (!refusal.empty()) return {kDoNothing, refusal};
  state_ = row->to;
  return {row->actions, ""};
}

}  // namespace trn
