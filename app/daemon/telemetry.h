#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "app/daemon/realtime.h"
#include "app/daemon/supervisor.h"
#include "app/session/feature_meter.h"
#include "core/machine.h"
#include "hal/lcm_messages.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What the daemon knows of itself, beside the tick's report.
struct DaemonView {
  MachineState state = MachineState::kOff;
  std::string program;    ///< path, "mdi" or ""
  std::string message;    ///< last message of the program or the planner
  std::string waits_for;  ///< what the machine stands for
  bool program_failed = false;
  double override_wanted = 1, rapid_override = 1, spindle_override = 1, adaptive_feed = 1;
  std::vector<std::string> warnings;
};

/// Unix time, us.
std::int64_t unix_time_us();
/// A clock of this host that only runs forward, us.
std::int64_t monotonic_us();

/// What the machine stands and waits for, and who goes on, in words for people; "" if it does not.
std::string waits_text(const CycleReport& report, const std::function<std::string(int)>& tool_name);

/// status_t and motion_t (hal/lcm) from what the daemon knows; time_us and count are left to the caller.
trunnion::status_t make_status(const Machine& machine, const DaemonView& view, const CycleReport& report,
                               const LoopStatistics& statistics);
/// The first twenty features of a program into its status.
void add_features(const std::vector<FeatureDeflection>& features, trunnion::status_t& status);
/// The way back, of a client.
std::vector<FeatureDeflection> features_of(const trunnion::status_t& status);
trunnion::motion_t make_motion(const CycleReport& report);

}  // namespace trn
