#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "compensation/sensor_board.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "interp/gcode/program_config.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// Everything that makes the real machine reach the ideal pose, in the one order in which it acts: `pose`
/// and `joint` inside the plan (MachineJointMap), then `setpoint` in the tick. A member that the config does
/// not have is empty.
struct Corrections {
  std::unique_ptr<PoseCorrection> pose;
  std::unique_ptr<JointCorrection> joint;
  std::uint8_t planned_off = 0;          ///< of `pose` and `joint`: bits of those off at start (MapContext)
  std::unique_ptr<SensorBoard> sensors;  ///< never null; the channels that corrections look at
  std::unique_ptr<SetpointChain> setpoint;  ///< never null; may have no links
  /// To be called outside the tick, always by one thread, several times a second.
  std::vector<std::function<void()>> background;
};

/// Section [corrections] with one table for each correction; it may be missing.
Corrections read_corrections(const Machine& machine);

/// The keys m_on and m_off of every correction: the M codes that switch it from a program.
std::vector<SwitchCode> read_switches(const ConfigTable& root, const ProgramConfig& program);

/// The keys that every correction behind the plan has: enabled, limit_mm, limit_deg, reserve.
SetpointBudget read_budget(const ConfigTable& table, const char* name);

}  // namespace trn
