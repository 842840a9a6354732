#include "app/daemon/telemetry.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <utility>

#include "app/client/running_daemons.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "interp/gcode/active_codes.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/settings.h"

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
    status.joint_homed.push_back(report.homed_mask >> i & 1u);
    status.joint_limit_switch.push_back(report.limit_switch_mask >> i & 1u);
  }
}

// Where it stands, once the operator has moved it along the path.
std::string behind_text(const CycleReport& report) {
  if (report.detour == DetourState::kRetraces) return "; it moves along its path";
  const char* const end = report.behind_end ? "; there is no more path that way" : "";
  return report.behind_mm == 0
             ? end
             : fmt::format(" from here, {:.1f} mm behind the place of the hold{}", report.behind_mm, end);
}

std::string waits_in_place(const CycleReport& report, const ProgramStep* step,
                           const std::function<std::string(int)>& tool_name) {
  using Kind = QueueEvent::Kind;
  const QueueEvent& event = report.waits_at;
  const std::string remark = step ? remark_of(step->text.data()) : "";
  const auto stop = [&](const char* name) {
    return remark.empty() ? fmt::format("{}: 'resume' goes on", name)
                          : fmt::format("{}: {}; 'resume' goes on", name, remark);
  };
  if (report.rate_plan_late && report.motion == MotionState::kMoving && report.override_now == 0)
    return "the rate planner (rate_plan_late): the motion goes on when it answers";
  if (report.motion == MotionState::kHeld) return "hold: 'resume' goes on" + behind_text(report);
  switch (event.kind) {
    case Kind::kToolChange: {
      const std::string tool = tool_name(event.argument);
      const char* const do_it = event.argument == 0 ? "take the tool out of" : "put it into";
      return event.value == kToolByOperator
                 ? fmt::format("{}: {} the spindle, then 'resume'", tool, do_it)
                 : fmt::format("{}: {} the spindle; input {} confirms it", tool, do_it, event.value);
    }
    case Kind::kProgramStop:
      return stop("program stop (M0)");
    case Kind::kOptionalStop:
      return stop("optional stop (M1)");
    case Kind::kWaitInput: {
      const InputArgument input = InputArgument::unpack(event.argument);
      return fmt::format("{} input {} (M66)", input.analog ? "analog" : "digital", input.index);
    }
    case Kind::kSpindle:
      return fmt::format("the spindle to reach {:.0f} rpm", std::abs(event.value));
    case Kind::kSpindleOrient:
      return fmt::format("the spindle to stand at {:g} degrees", event.value);
    case Kind::kProbeStart:
      return "the probe to be armed";
    default:
      break;
  }
  if (report.motion == MotionState::kPaused) return "single block: 'resume' runs the next line";
  const std::string motion = step && step->moves ? g_name(step->settings.motion) : "";
  const bool probes = report.motion == MotionState::kMoving && motion.rfind("G38", 0) == 0;
  return probes ? fmt::format("contact of the probe ({}), or the end of the move", motion) : "";
}

}  // namespace

std::string_view detour_name(DetourState state) {
  static constexpr std::string_view kNames[] = {"", "jogs", "away", "returns", "retraces"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(DetourState::kRetraces) + 1);
  return kNames[static_cast<std::size_t>(state)];
}

std::int64_t unix_time_us() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

std::int64_t daemon_clock_us() {
  const auto monotonic_us = [] {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
  };
  static const std::int64_t ahead = unix_time_us() - monotonic_us();
  return monotonic_us() + ahead;
}

std::string remark_of(std::string_view block) {
  std::string out;
  const auto add = [&](std::string_view text) {
    const std::size_t from = text.find_first_not_of(" \t"), to = text.find_last_not_of(" \t");
    if (from == std::string_view::npos) return;
    out += (out.empty() ? "" : "; ") + std::string(text.substr(from, to - from + 1));
  };
  while (!block.empty()) {
    const std::size_t begin = block.find_first_of("(;");
    if (begin == std::string_view::npos) break;
    const bool to_end = block[begin] == ';';
    const std::size_t end = to_end ? block.size() : std::min(block.find(')', begin), block.size());
    add(block.substr(begin + 1, end - begin - 1));
    block = block.substr(std::min(end + 1, block.size()));
  }
  return out;
}

std::string waits_text(const CycleReport& report, const ProgramStep* step,
                       const std::function<std::string(int)>& tool_name) {
  if (report.motion == MotionState::kMoving && report.detour != DetourState::kNone)
    return "the way back to where the program was held";
  const std::string text = waits_in_place(report, step, tool_name);
  const bool away =
      report.detour != DetourState::kNone && report.detour != DetourState::kRetraces && !text.empty();
  return away ? text + "; first it leads back and switches on what the program had on" : text;
}

trunnion::status_t first_status(const Machine& machine, const std::string& version,
                                std::vector<std::string> warnings) {
  trunnion::status_t status{};
  status.version = version;
  status.time_left_s = -1;
  status.pid = getpid();
  status.machine = machine.name;
  status.config_file = std::filesystem::absolute(machine.root.file()).lexically_normal();
  status.config_mark = file_mark(status.config_file);
  if (const auto program = machine.root.table_if("program"))
    for (const std::string& axis : program->texts("wrapped", {})) status.wrapped += axis;
  status.period_s = machine.period_s;
  status.override_wanted = status.rapid_override = status.spindle_override = status.adaptive_feed = 1;
  status.realtime = warnings.empty();
  status.warning_count = static_cast<std::int32_t>(warnings.size());
  status.warnings = std::move(warnings);
  return status;
}

void fill_status(const Machine& machine, MachineState state, const CycleReport& report,
                 const LoopStatistics& statistics, trunnion::status_t& status) {
  status.state = to_string(state);
  const bool pressed = state == MachineState::kEstop && report.fault == Fault::kOk;
  status.fault = fault_info(pressed ? Fault::kEmergencyStop : report.fault).name;
  const bool at_joint = report.fault_joint >= 0;
  status.fault_joint = at_joint ? machine.joints[static_cast<std::size_t>(report.fault_joint)].name : "";
  status.line = static_cast<std::int32_t>(report.line);
  status.spindle_rpm = report.spindle_rpm;
  status.single_block = report.single_block;
  status.optional_stop = report.optional_stop;
  status.machine_lock = report.machine_lock;
  status.override_now = report.override_now;
  status.starvations = report.starvations;
  add_timing(statistics, status);
  add_joints(machine, report, status);
}

void add_features(const std::vector<FeatureDeflection>& features, trunnion::status_t& status) {
  constexpr std::size_t kToldMax = 20;
  const std::size_t told = std::min(features.size(), kToldMax);
  status.feature_count = static_cast<std::int32_t>(told);
  status.features_more = static_cast<std::int32_t>(features.size() - told);
  for (std::size_t i = 0; i < told; ++i) {
    const FeatureDeflection& f = features[i];
    status.feature_line.push_back(static_cast<std::int32_t>(f.line));
    status.feature_last_line.push_back(static_cast<std::int32_t>(f.last_line));
    status.feature_circle.push_back(f.circle);
    status.feature_size_mm.push_back(f.size_mm);
    status.feature_bending_mm.push_back(f.bending_mm);
    status.feature_offset_mm.push_back(f.offset_mm);
    status.feature_predicted_mm.push_back(f.predicted_mm());
    status.feature_unknown.push_back(f.unknown);
  }
}

std::vector<FeatureDeflection> features_of(const trunnion::status_t& status) {
  std::vector<FeatureDeflection> out(status.feature_line.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i].line = static_cast<std::uint32_t>(status.feature_line[i]);
    out[i].last_line = static_cast<std::uint32_t>(status.feature_last_line[i]);
    out[i].circle = status.feature_circle[i] != 0;
    out[i].size_mm = status.feature_size_mm[i];
    out[i].bending_mm = status.feature_bending_mm[i];
    out[i].offset_mm = status.feature_offset_mm[i];
    out[i].unknown = status.feature_unknown[i];
  }
  return out;
}

void add_corrections(const CycleReport& report, int off_between, const MachineJointMap* map,
                     const SetpointChain* chain, trunnion::status_t& status) {
  const auto add = [&](const std::string& name, bool on, double offset, const char* warning) {
    status.correction_name.push_back(name);
    status.correction_on.push_back(on);
    status.correction_offset.push_back(offset);
    status.correction_warning.emplace_back(warning);
  };
  const bool in_program = report.on_path && report.motion != MotionState::kRest;
  const int off = in_program ? report.context.corrections_off : off_between;
  if (map && map->has_pose()) add("geometric", (off & kGeometricBit) == 0, 0, "");
  if (map && map->has_joint()) add("joint_table", (off & kJointTableBit) == 0, 0, "");
  for (int i = 0; chain && i < chain->size(); ++i) {
    const CorrectionReport& link = report.corrections[static_cast<std::size_t>(i)];
    const double offset = link.offset.size() > 0 ? link.offset.cwiseAbs().maxCoeff() : 0;
    add(chain->budget(i).name, link.enabled, offset, link.warning);
  }
  status.correction_count = static_cast<std::int32_t>(status.correction_name.size());
}

bool follows_program(const CycleReport& report) {
  return report.motion == MotionState::kMoving || report.motion == MotionState::kHeld ||
         report.motion == MotionState::kPaused;
}

std::uint32_t present_step(const CycleReport& report) { return follows_program(report) ? report.step : 0; }

void add_step(const ProgramStep& step, const std::string& tool_name, trunnion::status_t& status) {
  const Settings& s = step.settings;
  const auto put = [&](const ProgramWords& words, double* out) {
    const Words si = in_radians(in_mm(words, s.modal.inch));
    std::copy(si.begin(), si.end(), out);
  };
  status.file = step.file.data();
  status.block = step.text.data();
  status.codes = active_codes(s, step.cutter_comp);
  status.inch = s.modal.inch;
  status.plane = s.modal.plane == Plane::kXY ? "G17" : s.modal.plane == Plane::kXZ ? "G18" : "G19";
  status.work_offset = g_name(kWorkOffsetCodes[static_cast<std::size_t>(s.modal.work_offset - 1)]);
  put(s.g5x, status.work_offset_value);
  put(s.g92, status.g92);
  status.rotation_rad = rad_from_deg(s.rotation_deg);
  status.tool = s.current_tool;
  status.tool_name = tool_name;
  status.tool_selected = s.selected_tool;
  put(s.tool_offset, status.tool_offset);
  status.tool_radius_mm = step.tool_radius_mm;
  status.feed = s.modal.feed;
  status.spindle_speed = s.modal.speed;
  status.mist = s.modal.mist;
  status.flood = s.modal.flood;
  status.rtcp = s.rtcp;
}

void add_positions(const ShownPosition& position, trunnion::motion_t& motion) {
  const auto put = [](const auto& words, double* out) {
    const Words si = in_radians(words);
    std::copy(si.begin(), si.end(), out);
  };
  put(position.work, motion.work);
  put(position.machine, motion.machine);
  put(position.to_go, motion.to_go);
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
