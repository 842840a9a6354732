#include "app/cli/shown_state.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <iterator>
#include <string_view>

#include "app/daemon/telemetry.h"
#include "app/session/feature_report.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kOnCircle = 1e-4 / 720;  // turns: half of the last digit that is shown

using trunnion::motion_t;
using trunnion::status_t;

/// Lines with a name in front.
class Lines {
 public:
  template <typename... Args>
  void put(std::string_view name, fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), "{:<9} ", name);
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

// In the program's unit of length, and degrees.
double shown(double value, int axis, bool inch) {
  if (axis >= kA) return value * kDegPerRad;
  return inch ? value / kMmPerInch : value;
}

// 0 to below 360 degrees; what would be shown as 360.0000 is 0 of the next turn.
double on_circle(double value) {
  const double turns = value / (2 * kPi);
  const double rest = turns - std::floor(turns + kOnCircle);
  return 2 * kPi * std::max(0.0, rest);
}

std::string number(double value, int axis, bool inch) {
  // Without the minus of a zero that is only rounded.
  const int digits = inch && axis < kA ? 5 : 4;
  const double scale = std::pow(10.0, digits);
  return fmt::format("{:.{}f}", std::round(shown(value, axis, inch) * scale) / scale + 0.0, digits);
}

void put_state(const status_t& status, Lines& out) {
  out.put("machine", "{} (process {})", status.machine, status.pid);
  out.put("state", "{}{}{}{}", status.state,
          status.single_block ? "; single block: stands at the end of every line" : "",
          status.optional_stop ? "" : "; M1 does not stop",
          status.block_delete ? "; lines with / are skipped" : "");
  if (status.dry_run) out.put("", "DRY RUN: feed moves go at rapid speed, the spindle stays off");
  if (status.machine_lock) out.put("", "MACHINE LOCK: programs run, and no joint moves");
  if (status.fault != "ok")
    out.put("fault", "{}{}{}", status.fault, status.fault_joint.empty() ? "" : " at joint ",
            status.fault_joint);
  if (const FaultInfo* fault = find_fault(status.fault); fault && status.fault != "ok") {
    out.put("", "{}", fault->meaning);
    out.put("cure", "{}", fault->remedy);
  }
  if (!status.waits_for.empty()) out.put("waits for", "{}", status.waits_for);
  if (!status.message.empty()) out.put("message", "{}", status.message);
  if (status.alarms_open > 0)
    out.put("alarms", "{} not acknowledged; the newest: {}", status.alarms_open, status.alarm);
}

void put_program(const status_t& status, Lines& out) {
  if (status.program.empty()) return out.put("program", "none");
  out.put("program", "{}, line {}", status.program, status.line);
  const bool sub = !status.file.empty() && !status.program.ends_with(status.file);
  if (!status.block.empty()) out.put(sub ? status.file : "", "{}", status.block);
}

std::string clock_text(double time_s) {
  const auto s = static_cast<long>(std::llround(time_s));
  return s >= 3600 ? fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
                   : fmt::format("{}:{:02}", s / 60, s % 60);
}

void put_time(const status_t& status, Lines& out) {
  if (status.time_total_s > 0)
    out.put("time", "{} of {} done ({:.0f} %), {} left{}", clock_text(status.time_done_s),
            clock_text(status.time_total_s), 100 * status.time_done_s / status.time_total_s,
            status.time_left_s < 0 ? "standing, no time" : clock_text(status.time_left_s),
            status.time_about ? ", about" : "");
  out.put("counters", "{} parts; ran {} in this program, {} in all", status.parts,
          clock_text(status.program_run_s), clock_text(status.run_s));
}

void put_positions(const status_t& status, const motion_t& motion, Lines& out) {
  out.put("position", "{:>13}{:>14}{:>14}", "work", "machine", "to go");
  const std::string_view words = kWordLetters;
  for (const char letter : status.axes) {
    const auto axis = static_cast<int>(words.find(letter));
    if (axis < 0 || axis >= 6) continue;
    const bool wrapped = axis >= kA && status.wrapped.find(letter) != std::string::npos;
    const auto place = [&](double value) {
      return number(wrapped ? on_circle(value) : value, axis, status.inch);
    };
    const std::string turn =
        wrapped ? fmt::format(", turn {:.0f}", std::floor(motion.machine[axis] / (2 * kPi) + kOnCircle)) : "";
    out.put("", "{} {:>11}{:>14}{:>14}{}{}", letter, place(motion.work[axis]), place(motion.machine[axis]),
            number(motion.to_go[axis], axis, status.inch),
            axis >= kA    ? " deg"
            : status.inch ? " in"
                          : " mm",
            turn);
  }
}

std::string offset_text(const status_t& status, const double* values) {
  std::string text;
  const std::string_view words = kWordLetters;
  for (const char letter : status.axes) {
    const auto axis = static_cast<int>(words.find(letter));
    if (axis >= 0 && axis < 6 && values[axis] != 0)
      text += fmt::format(" {}{}", letter, number(values[axis], axis, status.inch));
  }
  return text;
}

void put_modes(const status_t& status, Lines& out) {
  const std::string g92 = offset_text(status, status.g92);
  out.put(
      "offset", "{}{}{}{}", status.work_offset, offset_text(status, status.work_offset_value),
      g92.empty() ? "" : "; G92" + g92,
      status.rotation_rad == 0 ? "" : fmt::format("; turned by {:g} deg", status.rotation_rad * kDegPerRad));
  const std::string length = offset_text(status, status.tool_offset);
  out.put("tool", "{}{}{}", status.tool_name, length.empty() ? ", no length offset" : ", offset" + length,
          status.tool_radius_mm > 0
              ? fmt::format(", radius {}", number(status.tool_radius_mm, kX, status.inch))
              : "");
  out.put("codes", "{}{}", status.codes, status.rtcp ? "; tool centre point control" : "");
}

void put_speeds(const status_t& status, const motion_t& motion, Lines& out) {
  const double unit = status.inch ? kMmPerInch : 1;
  out.put("feed", "F{:g}; {:.1f} {}/min now, at {:.0f} % of the plan", status.feed,
          60 * motion.speed_mm_s / unit, status.inch ? "in" : "mm", 100 * motion.override_now);
  out.put("override", "feed {:.0f} %, rapid {:.0f} %, spindle {:.0f} %, adaptive feed {:.0f} %",
          100 * status.override_wanted, 100 * status.rapid_override, 100 * status.spindle_override,
          100 * status.adaptive_feed);
  out.put("spindle", "S{:g}; {:g} rpm asked for now{}; coolant {}", status.spindle_speed, status.spindle_rpm,
          status.spindle_real_known ? fmt::format(", {:.0f} rpm real", status.spindle_real_rpm) : "",
          status.mist && status.flood ? "mist and flood"
          : status.mist               ? "mist"
          : status.flood              ? "flood"
                                      : "off");
  if (motion.tool_load_alarm) out.put("load", "unknown: the model no longer fits");
  if (motion.tool_load_known)
    out.put("load", "tool {:.2f} {:.2f} N, bent {:.4f} {:.4f} mm", motion.tool_force_N[0],
            motion.tool_force_N[1], motion.tool_deflection_mm[0], motion.tool_deflection_mm[1]);
}

void put_joints(const status_t& status, const motion_t& motion, Lines& out) {
  std::string text;
  for (std::size_t i = 0; i < status.joint_name.size(); ++i) {
    const bool rotary = status.joint_unit[i] == "rad";
    const double q = i < motion.q_measured.size() ? motion.q_measured[i] : 0;
    text += fmt::format("{}{} {:.4f}{}{}", i == 0 ? "" : ", ", status.joint_name[i],
                        (rotary ? kDegPerRad : 1) * q, status.joint_homed[i] ? "" : " (not homed)",
                        status.joint_limit_switch[i] ? " (on a limit switch)" : "");
  }
  out.put("joints", "{}", text);
}

void put_corrections(const status_t& status, Lines& out) {
  for (std::size_t i = 0; i < status.correction_name.size(); ++i) {
    const std::string& warning = status.correction_warning[i];
    out.put(i == 0 ? "corrects" : "", "{} {}, {:.6f} now{}{}", status.correction_name[i],
            status.correction_on[i] ? "on" : "off", status.correction_offset[i], warning.empty() ? "" : "; ",
            warning);
  }
}

void put_timing(const status_t& status, Lines& out) {
  out.put("tick", "every {:g} ms, {} so far, {} overruns, {} starvations", 1000 * status.period_s,
          status.periods, status.overruns, status.starvations);
  out.put("lateness", "{:.0f} us median, {:.0f} us p99.9, {:.0f} us worst", status.wake_us_p50,
          status.wake_us_p999, status.wake_us_max);
  out.put("duration", "{:.0f} us median, {:.0f} us p99.9, {:.0f} us worst", status.tick_us_p50,
          status.tick_us_p999, status.tick_us_max);
  if (!status.bus_health.empty()) out.put("bus", "{}", status.bus_health);
}

// A line that is longer than the screen would push the ones below it out of their places.
std::string cut_lines(const std::string& text, int columns) {
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    out += text.substr(begin, std::min(end - begin, static_cast<std::size_t>(std::max(columns, 1))));
    out += '\n';
    begin = end + 1;
  }
  return out;
}

// What both the status and the screen show.
void put_machine(const status_t& status, const motion_t& motion, Lines& out) {
  put_state(status, out);
  put_program(status, out);
  put_time(status, out);
  put_positions(status, motion, out);
  put_modes(status, out);
  put_speeds(status, motion, out);
  put_joints(status, motion, out);
}

}  // namespace

std::string status_text(const status_t& status, const motion_t& motion) {
  Lines out;
  put_machine(status, motion, out);
  put_corrections(status, out);
  put_timing(status, out);
  std::string text = out.take();
  text += features_text(features_of(status), static_cast<std::size_t>(status.features_more));
  for (const std::string& warning : status.warnings) text += fmt::format("WARNING   {}\n", warning);
  return text;
}

std::string alarms_text(const trunnion::alarms_t& alarms) {
  std::string text;
  for (std::size_t i = 0; i < alarms.alarm_number.size(); ++i) {
    const std::time_t since = alarms.alarm_since_us[i] / 1000000;
    text += fmt::format("ALARM {:<3} {} {:%F %T}{}{}: {}\n", alarms.alarm_number[i], alarms.alarm_name[i],
                        fmt::localtime(since),
                        alarms.alarm_times[i] > 1 ? fmt::format(", {} times", alarms.alarm_times[i]) : "",
                        alarms.alarm_active[i] ? "" : ", over", alarms.alarm_text[i]);
    const auto more = [&](const char* name, const std::string& words) {
      if (!words.empty()) text += fmt::format("          {}: {}\n", name, words);
    };
    more("cure", alarms.alarm_cure[i]);
    more("did", alarms.alarm_did[i]);
    if (!alarms.alarm_program[i].empty())
      more("in", fmt::format("{}, line {}", alarms.alarm_program[i], alarms.alarm_line[i]));
    more("cause", alarms.alarm_cause[i]);
  }
  return text;
}

std::string screen_text(const status_t& status, const motion_t& motion, int columns) {
  Lines out;
  put_machine(status, motion, out);
  return cut_lines(out.take(), columns);
}

std::string motion_line(const status_t& status, const motion_t& motion) {
  std::string joints;
  for (std::size_t i = 0; i < status.joint_name.size() && i < motion.q_measured.size(); ++i)
    joints += fmt::format(" {}{:.4f}", status.joint_name[i],
                          (status.joint_unit[i] == "rad" ? kDegPerRad : 1) * motion.q_measured[i]);
  return fmt::format("{:10} line {:6} {:9.3f} mm/s {:4.0f} %{}\n", motion.period, motion.line,
                     motion.speed_mm_s, 100 * motion.override_now, joints);
}

}  // namespace trn
