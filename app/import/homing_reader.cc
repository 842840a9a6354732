#include "app/import/homing_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/import/import_place.h"
#include "app/import/ini_file.h"

namespace trn {

namespace {

constexpr double kServo_rad_s = 2 * std::numbers::pi * 40;  // natural frequency of a simulated drive
constexpr double kSearchSpeed = 10;                         // where the INI has none; mm or degrees a second
// So slow, in mm or degrees a second, that nobody asks where behind the index the drive has come to rest.
constexpr double kIndexSpeed = 0.25;
constexpr double kIndexSettles_s = 4 / kServo_rad_s;  // measured: the servo goes on for less than this
constexpr double kCrawl_s = 20;
constexpr double kLeastDistance = 1e-3;

std::string range_text(const ImportedJoint& joint) {
  return fmt::format("the range of {}, {:.10g} to {:.10g} {}", joint.name, joint.min, joint.max,
                     joint.rotary ? "degrees" : "mm");
}

bool is_outside(const ImportedJoint& joint, double at) { return at < joint.min || at > joint.max; }

std::string told_value(const JointSection& section, const char* key) {
  const IniEntry* entry = section.ini.find(section.name, key);
  return entry ? entry->text() : fmt::format("[{}] has no {}, which is 0", section.name, key);
}

void note_outside(const JointSection& section, const ImportedJoint& joint, ImportedMachine& machine) {
  if (is_outside(joint, joint.home))
    machine.note(
        ImportSpot::kDrives, section.place("HOME"), told_value(section, "HOME"),
        fmt::format("it lies beyond {}; the simulated drive stands at {:.10g} instead, as near as the "
                    "range lets it",
                    range_text(joint), std::clamp(joint.home, joint.min, joint.max)),
        "look whether HOME or the limits are what you mean");
  if (joint.searches && is_outside(joint, joint.switch_at))
    machine.note(
        ImportSpot::kDrives, section.place("HOME_OFFSET"), told_value(section, "HOME_OFFSET"),
        fmt::format("the switch lies beyond {}; the one of the simulated drive lies inside",
                    range_text(joint)),
        fmt::format("with real drives home_{0} must lie within the range: widen min_{0} or max_{0}, or "
                    "move the switch",
                    joint.rotary ? "deg" : "mm"));
}

/// How far a joint goes on that is told to stand when it has this speed: its ramp, what the servo is behind,
/// and some periods until it is told.
double stopping_distance(double speed, double acceleration, double period_s) {
  constexpr int kPeriods = 4;
  return speed * speed / (2 * acceleration) + kPeriods * speed * period_s +
         2 * acceleration / (kServo_rad_s * kServo_rad_s);
}

}  // namespace

void read_homing(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  joint.home = section.length("HOME").value_or(0);
  joint.switch_at = section.length("HOME_OFFSET").value_or(0);
  const double search = section.length("HOME_SEARCH_VEL").value_or(0);
  const double latch = section.length("HOME_LATCH_VEL").value_or(0);
  joint.search_speed = std::abs(search);
  joint.latch_speed = std::abs(latch);
  joint.searches = search != 0 || latch != 0;
  joint.following_error = section.length("FERROR").value_or(0);
  if (const std::optional<double> sequence = section.ini.number(section.name, "HOME_SEQUENCE"))
    joint.sequence = static_cast<int>(std::clamp(*sequence, -100.0, 100.0));
  note_outside(section, joint, machine);
  if (search > 0)
    machine.note(
        ImportSpot::kDrives, section.place("HOME_SEARCH_VEL"),
        fmt::format("[{}]HOME_SEARCH_VEL is positive", section.name),
        "simulated drives search downwards a switch that lies just below HOME, and end at HOME; real "
        "ones search as their homing method says",
        "on CANopen choose homing_method (17 to 30: switches at either end)");
}

double inside_range(const ImportedJoint& joint, double at) {
  const double rounding = joint.rotary ? 1e-9 : 0;
  const double low = joint.min + rounding * std::max(1.0, std::abs(joint.min));
  return std::max(std::min(at, joint.max - rounding * std::max(1.0, std::abs(joint.max))), low);
}

SimulatedHoming simulated_homing(const ImportedJoint& joint, double stand, double period_s) {
  const double a = joint.acceleration;
  SimulatedHoming out;
  const double search = joint.search_speed > 0 ? joint.search_speed : joint.latch_speed;
  // Where there is no room to stop from the search, the search is slower.
  out.search_speed = std::min(
      {search > 0 ? search : kSearchSpeed, joint.velocity, std::sqrt(a * (joint.max - joint.min) / 2)});
  // So slow that it stands at once when it has seen the index, but not for longer than that from the switch
  // on.
  const double stopping = stopping_distance(out.search_speed, a, period_s);
  out.index_speed =
      std::min(std::max(std::min(kIndexSpeed, a * period_s / 2), stopping / kCrawl_s), out.search_speed);
  const double v = out.index_speed;
  const double beyond_index = v * (4 * period_s + kIndexSettles_s) + v * v / (2 * a);
  const double room = stopping + beyond_index;
  out.home = inside_range(joint, stand - room);
  out.index_distance = std::max(stand - beyond_index - out.home, kLeastDistance);
  return out;
}

double search_time_s(const ImportedJoint& joint, const SimulatedHoming& homing) {
  const double v = homing.search_speed;
  return (joint.max - joint.min) / v + 4 * v / joint.acceleration +
         homing.index_distance / homing.index_speed;
}

}  // namespace trn
