#include "panel/server/metrics.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <string_view>

#include "core/axes.h"

namespace trn {

namespace {

using trunnion::motion_t;
using trunnion::status_t;

constexpr double kUs = 1e-6;

/// The text of a label, as the format wants it.
std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char letter : text) {
    if (letter == '\\' || letter == '"') out += '\\';
    out += letter == '\n' ? std::string("\\n") : std::string(1, letter);
  }
  return out + '"';
}

/// Collects samples; the help and type of a name stand once, before the first of them.
class Samples {
 public:
  explicit Samples(std::string_view machine) : machine_(quoted(machine)) {}

  void family(std::string_view name, std::string_view type, std::string_view help) {
    name_ = name;
    out_ += fmt::format("# HELP trunnion_{} {}\n# TYPE trunnion_{} {}\n", name, help, name, type);
  }
  void add(double value, std::string_view label = "", std::string_view of = "") {
    const std::string more = label.empty() ? "" : fmt::format(",{}={}", label, quoted(of));
    out_ += fmt::format("trunnion_{}{{machine={}{}}} {:.12g}\n", name_, machine_, more, value);
  }
  void one(std::string_view name, std::string_view type, std::string_view help, double value) {
    family(name, type, help);
    add(value);
  }
  std::string text() const { return out_; }

 private:
  std::string machine_, name_, out_;
};

void add_timing(const status_t& status, Samples& out) {
  out.one("ticks_total", "counter", "Ticks since the daemon's start.", static_cast<double>(status.periods));
  out.one("overruns_total", "counter", "Ticks that began or ended too late.",
          static_cast<double>(status.overruns));
  out.one("starvations_total", "counter", "Times the planner came too late and the motion stopped safely.",
          static_cast<double>(status.starvations));
  out.family("tick_late_seconds", "gauge", "Lateness of the tick's start.");
  out.add(kUs * status.wake_us_p50, "share", "0.5");
  out.add(kUs * status.wake_us_p999, "share", "0.999");
  out.add(kUs * status.wake_us_max, "share", "1");
  out.family("tick_seconds", "gauge", "Duration of the tick.");
  out.add(kUs * status.tick_us_p50, "share", "0.5");
  out.add(kUs * status.tick_us_p999, "share", "0.999");
  out.add(kUs * status.tick_us_max, "share", "1");
  out.one("realtime", "gauge", "1: the kernel granted real-time rights as configured.", status.realtime);
}

void add_state(const status_t& status, Samples& out) {
  constexpr std::array<std::string_view, 11> kStates{"off",     "starting", "idle",    "running",
                                                     "holding", "stopping", "jogging", "homing",
                                                     "fault",   "estop",    "closing"};
  out.family("state", "gauge", "1 for the state that the machine is in.");
  for (const std::string_view state : kStates) out.add(status.state == state ? 1 : 0, "state", state);
  out.family("fault", "gauge", "1 while a fault is latched, with its name.");
  out.add(status.fault == "ok" ? 0 : 1, "fault", status.fault);
  out.one("waits", "gauge", "1 while the machine waits for somebody.", status.waits_for.empty() ? 0 : 1);
  out.one("program_failed", "gauge", "1: the last program ended early.", status.program_failed);
  out.one("line", "gauge", "Line of the program that moves now.", status.line);
  out.one("tool", "gauge", "Tool in the spindle; 0: none.", status.tool);
  out.one("feed_override", "gauge", "Override of feed moves; 1: as programmed.", status.override_wanted);
  out.one("rapid_override", "gauge", "Override of rapid moves.", status.rapid_override);
  out.one("spindle_override", "gauge", "Override of the spindle.", status.spindle_override);
  out.one("spindle_rpm", "gauge", "Turns of the spindle a minute as commanded, + clockwise.",
          status.spindle_rpm);
}

void add_motion(const PanelConfig& config, const motion_t& motion, Samples& out) {
  out.one("tip_speed_mm_per_second", "gauge", "Speed of the tip along the path.", motion.speed_mm_s);
  out.family("joint_position", "gauge", "Measured place of each joint, mm or rad.");
  for (std::size_t i = 0; i < config.machine.joints.size() && i < motion.q_measured.size(); ++i)
    out.add(motion.q_measured[i], "joint", config.machine.joints[i].name);
}

}  // namespace

std::string metrics_text(const PanelConfig& config, const DaemonWatch& daemon, std::size_t pages) {
  Samples out(config.machine.name);
  out.one("up", "gauge", "1: the daemon of the machine is heard.", daemon.connected() ? 1 : 0);
  out.one("pages", "gauge", "Pages of the operator's panel that are open.", static_cast<double>(pages));
  if (!daemon.connected()) return out.text();
  add_state(*daemon.status(), out);
  add_timing(*daemon.status(), out);
  if (daemon.motion()) add_motion(config, *daemon.motion(), out);
  return out.text();
}

}  // namespace trn
