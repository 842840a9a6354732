#include "core/fault.h"

#include <array>
#include <cstddef>

namespace trn {

namespace {
constexpr std::array<FaultInfo, static_cast<std::size_t>(Fault::kCount)> kFaults = {{
    {"ok", Reaction::kNone, "no fault", ""},
    {"emergency_stop", Reaction::kQuickStop, "emergency stop was pressed or commanded",
     "release it, then reset"},
    {"starved", Reaction::kNone, "the planner was late, the machine stopped on its path",
     "motion resumes by itself; if it recurs, give the planner more processor time"},
    {"joint_limit", Reaction::kPathStop, "a setpoint would leave the position range of a joint",
     "move the work offset or the part, then reset"},
    {"setpoint_jump", Reaction::kQuickStop,
     "a setpoint would break a joint's velocity limit, it was not sent",
     "this is a defect of the control: keep the trace and report it"},
    {"kinematics", Reaction::kQuickStop, "the inverse kinematics failed in the tick",
     "this is a defect of the control: keep the trace and report it"},
    {"following_error", Reaction::kQuickStop, "a joint lags behind its setpoint by more than following_error",
     "check the axis for a blockage and the drive's tuning, then reset"},
    {"limit_switch", Reaction::kQuickStop, "a limit switch was hit",
     "reset, then jog the joint away from it"},
    {"drive_fault", Reaction::kQuickStop, "a drive reports a fault",
     "read the drive's error, clear its cause, then reset"},
    {"drive_lost", Reaction::kQuickStop, "a drive no longer answers",
     "check its supply and cabling, then reset"},
    {"not_homed", Reaction::kNone, "a program needs every joint homed", "home the machine"},
    {"cycle_overrun", Reaction::kPathStop, "a cycle did not finish within its period",
     "use a real-time kernel, isolate a processor or lengthen the period, then reset"},
    {"assertion", Reaction::kQuickStop, "an internal check failed in the tick",
     "this is a defect of the control: keep the trace and report it"},
    {"homing_failed", Reaction::kQuickStop, "a joint did not find its home position",
     "check the home switch and homing settings, then reset and home again"},
}};
}  // namespace

const FaultInfo& fault_info(Fault fault) noexcept { return kFaults[static_cast<std::size_t>(fault)]; }

}  // namespace trn
