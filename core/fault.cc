#include "core/fault.h"

#include <array>
#include <cstddef>

namespace trn {

namespace {
struct Row {
  Fault fault;
  FaultInfo info;
};
constexpr std::array<Row, static_cast<std::size_t>(Fault::kCount)> kFaults = {{
    {Fault::kOk, {"ok", Reaction::kNone, "no fault", ""}},
    {Fault::kEmergencyStop,
     {"emergency_stop", Reaction::kQuickStop, "emergency stop was pressed or commanded",
      "release it, then reset"}},
    {Fault::kStarved,
     {"starved", Reaction::kNone, "the planner was late, the machine stopped on its path",
      "motion resumes by itself; if it recurs, give the planner more processor time"}},
    {Fault::kJointLimit,
     {"joint_limit", Reaction::kPathStop, "a setpoint would leave the position range of a joint",
      "move the work offset or the part, then reset"}},
    {Fault::kSetpointJump,
     {"setpoint_jump", Reaction::kQuickStop,
      "a setpoint would break a joint's velocity limit, it was not sent",
      "this is a defect of the control: keep the trace and report it"}},
    {Fault::kKinematics,
     {"kinematics", Reaction::kQuickStop, "the inverse kinematics failed in the tick",
      "this is a defect of the control: keep the trace and report it"}},
    {Fault::kFollowingError,
     {"following_error", Reaction::kQuickStop,
      "a joint lags behind its setpoint by more than following_error",
      "check the axis for a blockage and the drive's tuning, then reset"}},
    {Fault::kLimitSwitch,
     {"limit_switch", Reaction::kQuickStop, "a limit switch was hit",
      "reset, then jog the joint away from it"}},
    {Fault::kDriveFault,
     {"drive_fault", Reaction::kQuickStop, "a drive reports a fault",
      "read the drive's error, clear its cause, then reset"}},
    {Fault::kDriveLost,
     {"drive_lost", Reaction::kQuickStop, "a drive no longer answers",
      "check its supply and cabling, then reset"}},
    {Fault::kNotHomed,
     {"not_homed", Reaction::kNone, "a program needs every joint homed", "home the machine"}},
    {Fault::kCycleOverrun,
     {"cycle_overrun", Reaction::kPathStop, "a cycle did not finish within its period",
      "give the process real-time rights (see the warnings), use a real-time kernel, isolate a processor, "
      "lengthen "
      "the period or raise realtime.late_periods_max, then reset"}},
    {Fault::kAssertion,
     {"assertion", Reaction::kQuickStop, "an internal check failed in the tick",
      "this is a defect of the control: keep the trace and report it"}},
    {Fault::kHomingFailed,
     {"homing_failed", Reaction::kQuickStop, "a joint did not find its home position",
      "check the home switch and homing settings, then reset and home again"}},
    {Fault::kHeartbeatLost,
     {"heartbeat_lost", Reaction::kPathStop, "a drive's heartbeat stays away while its feedback still comes",
      "check the drive's firmware and drives.heartbeat_ms, then reset"}},
    {Fault::kDriveWarning,
     {"drive_warning", Reaction::kPathStop, "a drive sent an emergency message and goes on working",
      "read the drive's error, clear its cause, then reset"}},
    {Fault::kDriveDropped,
     {"drive_dropped", Reaction::kQuickStop,
      "a drive left Operation Enabled, its mode or the operational state without being told",
      "check its enable input, its supply and who else sends on the bus, then reset"}},
    {Fault::kDriveNotReady,
     {"drive_not_ready", Reaction::kQuickStop, "a drive did not reach Operation Enabled in time",
      "check its supply, safe torque off and enable input, then reset"}},
    {Fault::kDriveRestarted,
     {"drive_restarted", Reaction::kQuickStop, "a drive booted while it was in use",
      "check its supply, then reset and home it again"}},
    {Fault::kDriveIgnores,
     {"drive_ignores", Reaction::kQuickStop,
      "a drive is enabled and does not follow its setpoints (bit 12 of its statusword)",
      "look for a limit in the drive itself (0x607D, 0x6072, an input), then reset"}},
    {Fault::kBusOff,
     {"bus_off", Reaction::kQuickStop, "the CAN controller took itself off the bus after too many errors",
      "check cable, termination and bit rate, then reset"}},
    {Fault::kBusDown,
     {"bus_down", Reaction::kQuickStop, "the CAN interface is down or gone",
      "plug it in and bring it up (ip link set can0 up), then reset"}},
    {Fault::kBusOverload,
     {"bus_overload", Reaction::kQuickStop, "frames could not be sent on the bus",
      "raise txqueuelen, look for foreign traffic (trunnion can monitor), then reset"}},
    {Fault::kForeignMaster,
     {"foreign_master", Reaction::kQuickStop, "somebody else sends SYNC, setpoints or a master's heartbeat",
      "take the other master off the bus, then reset"}},
    {Fault::kDeviceLost,
     {"device_lost", Reaction::kPathStop, "a Modbus device does not answer",
      "check its supply, wiring, address and bit rate, then reset"}},
    {Fault::kDeviceFault,
     {"device_fault", Reaction::kPathStop,
      "a Modbus device reports a fault or impossible values, or was to take a value that it cannot hold",
      "read the error behind it, clear its cause, then reset"}},
    {Fault::kProbe,
     {"probe", Reaction::kPathStop, "a probe move met no contact, or began where it should have ended",
      "check the probe, its battery and the move's end, then reset"}},
    {Fault::kSpindle,
     {"spindle", Reaction::kPathStop, "the spindle is not at its speed or place in time",
      "check its drive and io.spindle_timeout_s, then reset"}},
    {Fault::kGantryParted,
     {"gantry_parted", Reaction::kQuickStop, "the motors of a gantry have parted",
      "look what holds one side or slips, then reset and home again"}},
    {Fault::kEmergencyInput,
     {"emergency_input", Reaction::kQuickStop, "the emergency stop is pressed, or its wire is broken",
      "release it, then reset"}},
    {Fault::kEnableOff,
     {"enable_off", Reaction::kQuickStop, "the enable input is off while drives are on",
      "close the enable circuit, then reset"}},
    {Fault::kDoorOpen,
     {"door_open", Reaction::kPathStop, "a door is open while something moves or the spindle turns",
      "close it, then reset"}},
    {Fault::kAirPressure,
     {"air_pressure", Reaction::kPathStop, "the air pressure is away while something moves",
      "check compressor and hose, then reset"}},
    {Fault::kSafeTorqueOff,
     {"safe_torque_off", Reaction::kQuickStop, "a drive has no torque: its Safe Torque Off is active",
      "close the safety circuit (emergency stop, doors), then reset"}},
}};

// A row that is missing or in a wrong place would give every fault behind it another's text.
constexpr bool in_order() {
  for (std::size_t i = 0; i < kFaults.size(); ++i)
    if (kFaults[i].fault != static_cast<Fault>(i) || kFaults[i].info.name.empty()) return false;
  return true;
}
static_assert(in_order());
}  // namespace

const FaultInfo& fault_info(Fault fault) TRN_RT { return kFaults[static_cast<std::size_t>(fault)].info; }

Fault worse(Fault first, Fault second) TRN_RT {
  // Of two faults with the same reaction the first one stays: what comes later is most often its consequence.
  if (second == Fault::kOk) return first;
  return first == Fault::kOk || fault_info(second).reaction > fault_info(first).reaction ? second : first;
}

const FaultInfo* find_fault(std::string_view name) noexcept {
  for (const Row& row : kFaults)
    if (row.info.name == name) return &row.info;
  return nullptr;
}

Fault fault_named(std::string_view name) noexcept {
  for (const Row& row : kFaults)
    if (row.info.name == name) return row.fault;
  return Fault::kOk;
}

}  // namespace trn
