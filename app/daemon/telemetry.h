#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "app/daemon/realtime.h"
#include "app/daemon/supervisor.h"
#include "app/session/feature_meter.h"
#include "app/session/program_step.h"
#include "core/machine.h"
#include "hal/lcm_messages.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// Unix time, us.
std::int64_t unix_time_us();
/// As status_t::detour.
std::string_view detour_name(DetourState state);
/// The daemon's own clock, us: Unix time when it is asked first, and from then on CLOCK_MONOTONIC, so that
/// nobody who sets the host's clock makes it jump. CLOCK_MONOTONIC alone begins anew with every boot: a
/// command that was held back over one would not have expired.
std::int64_t daemon_clock_us();

/// What the machine stands and waits for, and who goes on, in words for people; "" if it does not.
/// `step`: of the report; null: not known.
std::string waits_text(const CycleReport& report, const ProgramStep* step,
                       const std::function<std::string(int)>& tool_name);
/// The remarks of a line of a program: "turn the part" of "N10 M0 (turn the part)".
std::string remark_of(std::string_view block);

/// A program or MDI line moves or holds the machine: what the report says of the path is of now. Between
/// programs it is where the last one ended, and jogs and homing have moved on since.
bool follows_program(const CycleReport& report);

/// The status of a daemon that has done nothing yet: overrides at 1, nothing loaded, and what was not
/// granted.
trunnion::status_t first_status(const Machine& machine, const std::string& version,
                                std::vector<std::string> warnings);
/// What the tick and the supervisor know into a status; what the daemon alone knows stands in it already.
/// time_us, clock_us and count are left to the caller.
void fill_status(const Machine& machine, MachineState state, const CycleReport& report,
                 const LoopStatistics& statistics, trunnion::status_t& status);
/// The first twenty features of a program into its status.
void add_features(const std::vector<FeatureDeflection>& features, trunnion::status_t& status);
/// The way back, of a client.
std::vector<FeatureDeflection> features_of(const trunnion::status_t& status);
/// The machine's corrections, in the order in which they act. `off_between`: those inside the plan that are
/// off between programs, as MapContext; `map`, `chain`: null where there are none.
void add_corrections(const CycleReport& report, int off_between, const MachineJointMap* map,
                     const SetpointChain* chain, trunnion::status_t& status);
/// The step that is shown: of the program while it is at work; 0: what the next one begins with.
std::uint32_t present_step(const CycleReport& report);
/// What is in force where the machine is, in words and numbers for people.
void add_step(const ProgramStep& step, const std::string& tool_name, trunnion::status_t& status);
/// Where it is.
void add_positions(const ShownPosition& position, trunnion::motion_t& motion);
trunnion::motion_t make_motion(const CycleReport& report);

}  // namespace trn
