#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace trn {

/// State of the machine as the operator sees it.
enum class MachineState : std::uint8_t {
  kOff,       ///< drives without power
  kStarting,  ///< drives are brought up
  kIdle,      ///< enabled, at rest, nothing to do
  kRunning,   ///< a program or an MDI line moves the machine
  kHolding,   ///< slows down or stands on the path, or is jogged away from it; resume goes on
  kStopping,  ///< slows down on the path; the program is given up
  kJogging,
  kHoming,
  kFault,    ///< a fault is latched; reset clears it
  kEstop,    ///< emergency stop was commanded; reset clears it
  kClosing,  ///< the process ends: motion first, then the drives
  kCount
};
std::string_view to_string(MachineState state);

/// What happens to the supervisor. The first ones are commands and may be refused; the others come from the
/// machine and are ignored where they mean nothing.
enum class Event : std::uint8_t {
  kLoad,
  kStart,
  kHold,
  kResume,
  kStop,
  kMdi,
  kJog,
  kHome,
  kEstop,
  kReset,
  kTerminate,
  kDrivesReady,  ///< every drive is enabled
  kDrivesOff,    ///< the drives have disabled themselves
  kStartFailed,  ///< bring-up gave up
  kMotionDone,   ///< at rest, nothing left to do, and no drive moves by itself
  kPaused,       ///< the program stopped itself (M0, M1)
  kPathFault,    ///< a fault that stops on the path was latched
  kQuickFault,   ///< a fault that makes the drives quick-stop was latched
  kTimeout,      ///< closing takes too long
  kCount
};
inline constexpr int kCommandEvents = static_cast<int>(Event::kTerminate) + 1;
/// By event. A command's event has the name of its verb (app/client/command_table.h).
inline constexpr auto kEventNames =
    std::to_array<std::string_view>({"load", "start", "hold", "resume", "stop", "mdi", "jog", "home", "estop",
                                     "reset", "terminate", "drives_ready", "drives_off", "start_failed",
                                     "motion_done", "paused", "path_fault", "quick_fault", "timeout"});
static_assert(kEventNames.size() == static_cast<std::size_t>(Event::kCount));
std::string_view to_string(Event event);

/// What the daemon must do after an event; a set of bits.
enum Action : std::uint32_t {
  kDoNothing = 0,
  kDoBringUp = 1u << 0,
  kDoResetFaults = 1u << 1,
  kDoLoad = 1u << 2,
  kDoStart = 1u << 3,
  kDoHold = 1u << 4,
  kDoResume = 1u << 5,
  kDoStopOnPath = 1u << 6,
  kDoMdi = 1u << 7,
  kDoJog = 1u << 8,
  kDoHome = 1u << 9,
  kDoQuickStop = 1u << 10,
  kDoDropProgram = 1u << 11,  ///< forget what the planner has prepared
  kDoShutDown = 1u << 12,     ///< take the power from the drives
  kDoExit = 1u << 13,
};

/// What a command's legality hangs on besides the state.
struct Conditions {
  bool program_loaded = false;
  bool homed = false;           ///< every joint knows its position
  bool stands_in_hold = false;  ///< the tick obeys jogs and switches there
};

struct Decision {
  std::uint32_t actions = kDoNothing;
  std::string refusal;  ///< why a command was refused, and what would help; "" if it was accepted
};

/// One line of the state table.
struct Transition {
  MachineState from;
  Event event;
  MachineState to;
  std::uint32_t actions;
};

/// The supervisor's state machine: events in, actions out; no clock, no input or output of its own.
/// Everything it does stands in one table (supervisor.cc).
class Supervisor {
 public:
  MachineState state() const { return state_; }
  Decision handle(Event event, const Conditions& conditions);
  /// The same for a command of another name, which stands in a refusal.
  Decision handle(Event event, const Conditions& conditions, std::string_view command);

  static std::span<const Transition> table();

 private:
  MachineState state_ = MachineState::kOff;
};

}  // namespace trn
