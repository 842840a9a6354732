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

/// Unix time, us.
std::int64_t unix_time_us();
/// A clock of this host that only runs forward, us.
std::int64_t monotonic_us();

/// What the machine stands and waits for, and who goes on, in words for people; "" if it does not.
std::string waits_text(const CycleReport& report, const std::function<std::string(int)>& tool_name);

/// The status of a daemon that has done nothing yet: overrides at 1, nothing loaded, and what was not
/// granted.
trunnion::status_t first_status(const Machine& machine, std::vector<std::string> warnings);
/// What the tick and the supervisor know into a status; what the daemon alone knows stands in it already.
/// time_us, clock_us and count are left to the caller.
void fill_status(const Machine& machine, MachineState state, const CycleReport& report,
                 const LoopStatistics& statistics, trunnion::status_t& status);
/// The first twenty features of a program into its status.
void add_features(const std::vector<FeatureDeflection>& features, trunnion::status_t& status);
/// The way back, of a client.
std::vector<FeatureDeflection> features_of(const trunnion::status_t& status);
trunnion::motion_t make_motion(const CycleReport& report);

}  // namespace trn
