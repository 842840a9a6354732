#pragma once

#include "app/session/assembly.h"
#include "core/ports.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plans.h"

namespace trn {

/// What the tick has to know of a machine.
CycleConfig cycle_config(const Assembly& assembly, ProgramStops stops);

/// The tick of a machine, with the machine's own drives and devices. `assembly` and `queue` must outlive it.
Cycle make_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops);
/// The same with others in their place, as with the plans of `assembly.rate_plans`. `io` null: no devices
/// beside the drives.
Cycle make_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops, Drives& drives,
                 MachineIo* io, RatePlans& plans);
/// For a replay: the log has the inputs, and the faults that they caused; wiring and safety are not done
/// again.
Cycle make_replay_cycle(const Assembly& assembly, MotionQueue& queue, ProgramStops stops, Drives& drives,
                        MachineIo* io, RatePlans& plans);

}  // namespace trn
