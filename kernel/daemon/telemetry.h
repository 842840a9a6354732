#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/machine.h"
#include "hal/lcm_messages.h"
#include "kernel/daemon/realtime.h"
#include "kernel/daemon/supervisor.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What the daemon knows of itself, beside the tick's report.
struct DaemonView {
  MachineState state = MachineState::kOff;
  std::string program;  ///< path, "mdi" or ""
  std::string message;  ///< last message of the program or the planner
  bool program_failed = false;
  double override_wanted = 1, rapid_override = 1, spindle_override = 1, adaptive_feed = 1;
  std::vector<std::string> warnings;
};

/// Unix time, us.
std::int64_t unix_time_us();

/// status_t and motion_t (hal/lcm) from what the daemon knows; time_us and count are left to the caller.
trunnion::status_t make_status(const Machine& machine, const DaemonView& view, const CycleReport& report,
                               const LoopStatistics& statistics);
trunnion::motion_t make_motion(const CycleReport& report);

}  // namespace trn
