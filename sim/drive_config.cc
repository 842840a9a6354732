#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "core/axes.h"
#include "core/config.h"
#include "core/joint_range.h"
#include "core/machine.h"
#include "core/periods.h"
#include "core/units.h"
#include "sim/mechanism_config.h"
#include "sim/servo_mechanism.h"
#include "sim/simulated_drives.h"
#include "sim/simulated_joint.h"

namespace trn {

namespace {

/// Values of one joint in its own unit (mm or deg), before they become ready numbers.
struct JointKeys {
  double natural_frequency_hz = 40, damping = 0.7, velocity_feed_forward = 1;
  double following_error = 2;
  double homing_speed = 20, index_speed = 2, home = 0, index_distance = 1;
  double limit_switch_margin = 5;
  double start = 0;
  double quick_stop_factor = 2;  ///< times the joint's acceleration limit
  bool homed = true;
};

// Legal for all joints at once and for one joint; `unit` is mm or deg.
void read_common(const ConfigTable& table, std::string_view unit, JointKeys& keys) {
  const auto key = [&](std::string_view name) { return fmt::format("{}_{}", name, unit); };
  keys.following_error = table.number(key("following_error"), keys.following_error, kPositive);
  keys.homing_speed = table.number(key("homing_speed") + "_s", keys.homing_speed, kPositive);
  keys.index_speed = table.number(key("index_speed") + "_s", keys.index_speed, kPositive);
  keys.index_distance = table.number(key("index_distance"), keys.index_distance, kPositive);
  keys.limit_switch_margin = table.number(key("limit_switch_margin"), keys.limit_switch_margin, kNotNegative);
}

void read_unitless(const ConfigTable& table, JointKeys& keys) {
  keys.natural_frequency_hz = table.number("natural_frequency_hz", keys.natural_frequency_hz, kPositive);
  keys.damping = table.number("damping", keys.damping, Range{0.01, 100});
  keys.velocity_feed_forward = table.number("velocity_feed_forward", keys.velocity_feed_forward, Range{0, 2});
  keys.quick_stop_factor = table.number("quick_stop_factor", keys.quick_stop_factor, kPositive);
  keys.homed = table.boolean("homed", keys.homed);
}

void read_override(const ConfigTable& table, const Joint& joint, JointKeys& keys) {
  const std::string_view unit = joint.kind == JointKind::kRotary ? "deg" : "mm";
  const Range range = range_of_places(joint);
  read_unitless(table, keys);
  read_common(table, unit, keys);
  keys.home = table.number(fmt::format("home_{}", unit), keys.home, range);
  keys.start = table.number(fmt::format("start_{}", unit), keys.start, range);
}

SimulatedJoint::Config make_joint(const Joint& joint, double period_s, const JointKeys& keys) {
  const double unit = joint.kind == JointKind::kRotary ? kRadPerDeg : 1;
  const JointLimit& limit = joint.limit;
  SimulatedJoint::Config out;
  out.servo = {2 * kPi * keys.natural_frequency_hz, keys.damping, keys.velocity_feed_forward, period_s};
  out.following_error_max = unit * keys.following_error;
  out.quick_stop_deceleration = keys.quick_stop_factor * limit.acceleration;
  out.acceleration_max = out.acceleration_homing = limit.acceleration;
  // No faster than the joint may go, whatever the config asks for.
  out.speed_search = std::min(unit * keys.homing_speed, limit.velocity);
  out.speed_index = std::min(unit * keys.index_speed, limit.velocity);
  out.home = place_of(joint, keys.home);
  out.index_distance = unit * keys.index_distance;
  // Limit switches lie beyond the range of the joint: a program that keeps the range never meets them.
  out.switch_min = limit.min - unit * keys.limit_switch_margin;
  out.switch_max = limit.max + unit * keys.limit_switch_margin;
  out.start = place_of(joint, keys.start);
  out.homed = keys.homed;
  return out;
}

int joint_index(const Machine& machine, const ConfigTable& table, std::string_view key) {
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  const std::string name = table.choice(key, names);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

SimulatedDrives::ScriptedEvent read_event(const Machine& machine, const ConfigTable& table) {
  static const std::vector<std::string> kKinds = {"fault", "lost", "found", "stuck", "free"};  // as Kind
  SimulatedDrives::ScriptedEvent event;
  event.period = periods_of(table.number("at_s", kNotNegative), machine.period_s);
  event.joint = joint_index(machine, table, "joint");
  const std::string kind = table.choice("event", kKinds);
  event.kind = static_cast<SimulatedDrives::ScriptedEvent::Kind>(
      std::find(kKinds.begin(), kKinds.end(), kind) - kKinds.begin());
  return event;
}

// Zero, or the end of the joint's range nearest to it.
double rest_position(const Joint& joint) {
  const double unit = joint.kind == JointKind::kRotary ? kDegPerRad : 1;
  return unit * std::clamp(0.0, joint.limit.min, joint.limit.max);
}

}  // namespace

SimulatedDrives::Config read_simulated_drives(const Machine& machine, const ConfigTable& drives) {
  JointKeys linear, rotary;
  // Degrees a second, half of the default in mm/s.
  rotary.homing_speed = 10;
  rotary.index_speed = 1;
  read_unitless(drives, linear);
  read_unitless(drives, rotary);
  read_common(drives, "mm", linear);
  read_common(drives, "deg", rotary);
  std::vector<JointKeys> keys;
  for (const Joint& joint : machine.joints) {
    keys.push_back(joint.kind == JointKind::kRotary ? rotary : linear);
    keys.back().home = keys.back().start = rest_position(joint);
  }
  std::vector<std::optional<ServoMechanism::Config>> mechanisms(keys.size());
  // Behind the values for all joints: what a joint says of itself comes on top.
  std::vector<bool> seen(keys.size());
  for (const ConfigTable& table : drives.tables_if("joint")) {
    const auto i = static_cast<std::size_t>(joint_index(machine, table, "name"));
    if (seen[i]) throw table.error("name", "this joint has its table already");
    seen[i] = true;
    read_override(table, machine.joints[i], keys[i]);
    if (const auto mechanism = table.table_if("mechanism"))
      mechanisms[i] = read_mechanism(machine.joints[i], machine.period_s, *mechanism);
  }
  SimulatedDrives::Config config;
  const std::uint32_t start_up =
      periods_of(drives.number("start_up_s", 0.05, kNotNegative), machine.period_s);
  const std::uint32_t homing =
      periods_of(drives.number("homing_timeout_s", 120, kPositive), machine.period_s);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    config.joints.push_back(make_joint(machine.joints[i], machine.period_s, keys[i]));
    config.joints.back().start_up_periods = start_up;
    config.joints.back().homing_periods_max = homing;
    config.joints.back().mechanism = mechanisms[i];
  }
  for (const ConfigTable& table : drives.tables_if("script"))
    config.script.push_back(read_event(machine, table));
  return config;
}

}  // namespace trn
