#pragma once

#include <cstdint>
#include <string_view>

#include "core/realtime.h"

namespace trn {

/// What the supervisor does when a fault is latched.
enum class Reaction : std::uint8_t {
  kNone,       ///< report only
  kPathStop,   ///< stop all joints together, on the path, within limits; drives stay enabled
  kQuickStop,  ///< drives stop each by its own ramp, then disable
};

/// Every fault of the machine, in one table (core/fault.cc): name, reaction, what it means, what to do.
/// kNotHomed is never raised: the supervisor refuses a program before every joint is homed.
enum class Fault : std::uint8_t {
  kOk = 0,
  kEmergencyStop,
  kStarved,       ///< planner too late; the plan's own safe stop was run
  kJointLimit,    ///< a setpoint would leave a joint's position range
  kSetpointJump,  ///< a setpoint would break a velocity limit grossly: a defect, never sent
  kKinematics,    ///< inverse failed in the tick: a defect, never sent
  kFollowingError,
  kLimitSwitch,
  kDriveFault,
  kDriveLost,
  kNotHomed,  ///< never raised
  kCycleOverrun,
  kAssertion,  ///< an internal check failed in the tick
  kHomingFailed,
  kHeartbeatLost,   ///< feedback still comes
  kDriveWarning,    ///< an emergency message of a drive that goes on working
  kDriveDropped,    ///< left Operation Enabled, its mode or the operational state without being told
  kDriveNotReady,   ///< did not reach Operation Enabled in time
  kDriveRestarted,  ///< a node booted while it was in use
  kDriveIgnores,    ///< enabled and in its mode, but not following its target
  kBusOff,          ///< the CAN controller took itself off the bus
  kBusDown,         ///< the interface is down or gone
  kBusOverload,     ///< frames could not be sent
  kForeignMaster,   ///< somebody else sends SYNC, setpoints or the master's heartbeat
  kDeviceLost,      ///< a Modbus device does not answer
  kDeviceFault,     ///< a Modbus device reports a fault, or values that cannot be
  kProbe,           ///< a probe move met nothing, or began where it should have ended
  kSpindle,         ///< not at its speed or place in time
  kGantryParted,    ///< the motors of a gantry joint stand too far apart
  kEmergencyInput,  ///< the emergency stop's input is not safe
  kEnableOff,       ///< the enable input is off while drives are on
  kDoorOpen,        ///< a door is open while something moves
  kAirPressure,     ///< the air is away while something moves
  kSafeTorqueOff,   ///< a drive lost its torque by its own safety input
  kCount
};

struct FaultInfo {
  std::string_view name;
  Reaction reaction;
  std::string_view meaning;
  std::string_view remedy;
};

const FaultInfo& fault_info(Fault fault) TRN_RT;
/// Of two faults the one to report: the one that asks for the stronger reaction, the first if both ask for
/// the same. kOk is no fault.
Fault worse(Fault first, Fault second) TRN_RT;
/// By its name; null if there is no such fault.
const FaultInfo* find_fault(std::string_view name) noexcept;
/// The same; kOk if there is no such fault.
Fault fault_named(std::string_view name) noexcept;

}  // namespace trn
