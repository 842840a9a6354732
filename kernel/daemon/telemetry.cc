#include "kernel/daemon/telemetry.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>

namespace trn {

namespace {

void add_timing(const LoopStatistics& statistics, trunnion::status_t& status) {
  status.periods = static_cast<std::int64_t>(statistics.periods.load());
  status.overruns = static_cast<std::int64_t>(statistics.overruns.load());
  status.wake_us_p50 = statistics.wake.percentile_us(0.5);
  status.wake_us_p999 = statistics.wake.percentile_us(0.999);
  status.wake_us_max = statistics.wake.max_us();
  status.tick_us_p50 = statistics.tick.percentile_us(0.5);
  status.tick_us_p999 = statistics.tick.percentile_us(0.999);
  status.tick_us_max = statistics.tick.max_us();
}

void add_joints(const Machine& machine, const CycleReport& report, trunnion::status_t& status) {
  status.joint_count = static_cast<std::int32_t>(machine.joints.size());
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    status.joint_name.push_back(machine.joints[i].name);
    status.joint_unit.emplace_back(machine.joints[i].kind == JointKind::kRotary ? "rad" : "mm");
    status.homed.push_back(report.homed_mask >> i & 1u);
    status.limit_switch.push_back(report.limit_switch_mask >> i & 1u);
  }
}

}  // namespace

std::int64_t unix_time_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

trunnion::status_t make_status(const Machine& machine, const DaemonView& view, const CycleReport& report,
                               const LoopStatistics& statistics) {
  trunnion::status_t status{};
  status.pid = getpid();
  status.machine = machine.name;
  status.state = to_string(view.state);
  const bool pressed = view.state == MachineState::kEstop && report.fault == Fault::kOk;
  status.fault = fault_info(pressed ? Fault::kEmergencyStop : report.fault).name;
  if (report.fault_joint >= 0)
    status.fault_joint = machine.joints[static_cast<std::size_t>(report.fault_joint)].name;
  status.message = view.message;
  status.program_failed = view.program_failed;
  status.program = view.program;
  status.line = static_cast<std::int32_t>(report.line);
  status.override_wanted = view.override_wanted;
  status.rapid_override = view.rapid_override;
  status.spindle_override = view.spindle_override;
  status.adaptive_feed = view.adaptive_feed;
  status.spindle_rpm = report.spindle_rpm;
  status.single_block = report.single_block;
  status.override_now = report.override_now;
  status.period_s = machine.period_s;
  status.starvations = report.starvations;
  add_timing(statistics, status);
  status.warnings = view.warnings;
  status.warning_count = static_cast<std::int32_t>(view.warnings.size());
  status.realtime = view.warnings.empty();
  add_joints(machine, report, status);
  return status;
}

trunnion::motion_t make_motion(const CycleReport& report) {
  trunnion::motion_t motion{};
  motion.period = static_cast<std::int64_t>(report.period);
  motion.line = static_cast<std::int32_t>(report.line);
  motion.joint_count = static_cast<std::int32_t>(report.q_setpoint.size());
  motion.q_setpoint.assign(report.q_setpoint.begin(), report.q_setpoint.end());
  motion.q_measured.assign(report.q_measured.begin(), report.q_measured.end());
  std::copy(report.y.begin(), report.y.end(), motion.word);
  motion.speed_mm_s = report.speed_mm_s;
  motion.override_now = report.override_now;
  const ToolLoadReport& load = report.tool_load;
  motion.tool_load_known = load.known;
  motion.tool_load_alarm = load.alarm;
  for (int i = 0; i < 2; ++i) {
    motion.tool_force_N[i] = load.force_N[i];
    motion.tool_deflection_mm[i] = load.deflection_mm[i];
  }
  return motion;
}

}  // namespace trn
