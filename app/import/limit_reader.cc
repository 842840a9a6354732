#include "app/import/limit_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "app/import/import_place.h"
#include "app/import/ini_file.h"

namespace trn {

namespace {

constexpr double kEndlessDeg = 36000, kEndlessMm = 10000;
constexpr double kLimitsNone = 1e9;  // LinuxCNC's own default is 1e99

/// A limit of the path in [TRAJ], and the joints' key that it goes with.
struct PathLimit {
  const char* key;
  const char* joint_key;
  const char* unit;
  const char* bounded_by;  ///< what else bounds it here
};

constexpr PathLimit kPathLimits[] = {{"MAX_LINEAR_VELOCITY", "MAX_VELOCITY", "mm/s", "; F bounds feed moves"},
                                     {"MAX_LINEAR_ACCELERATION", "MAX_ACCELERATION", "mm/s^2", ""}};

const char* unit_name(const ImportedJoint& joint) { return joint.rotary ? "degrees" : "mm"; }

std::string rate_unit(const PathLimit& path, const ImportedJoint& joint) {
  const std::string unit = path.unit;
  return unit_name(joint) + unit.substr(unit.find('/'));
}

double& limit_of(const PathLimit& path, ImportedJoint& joint) {
  return std::string_view(path.joint_key) == "MAX_VELOCITY" ? joint.velocity : joint.acceleration;
}

std::optional<double> end_of(const JointSection& section, const char* key) {
  const std::optional<double> value = section.length(key);
  return value && std::abs(*value) < kLimitsNone ? value : std::nullopt;
}

void note_motor(const JointSection& motor, const char* key, double value, const std::string& unit,
                const ImportedJoint& joint, ImportedMachine& machine) {
  machine.note(
      ImportSpot::kJoint, motor.place(key), fmt::format("[{}]{}", motor.name, key),
      fmt::format("this second motor of axis {} is the narrower one; its limit holds for both: {:.10g} "
                  "{}",
                  joint.name, value, unit),
      "nothing", joint.name);
}

double read_end(const JointSection& section, const LimitSections& more, const char* key, double sign,
                ImportedJoint& joint, ImportedMachine& machine) {
  std::optional<double> end = end_of(section, key);
  const auto narrows = [&](double value) { return !end || sign * value < sign * *end; };
  const bool own = end.has_value();
  for (const JointSection& axis : more.axis)
    if (const std::optional<double> value = end_of(axis, key); value && narrows(*value)) {
      end = value;
      if (!own)
        machine.note(ImportSpot::kJoint, section.place(key), fmt::format("[{}] has no {}", section.name, key),
                     fmt::format("LinuxCNC bounds the axis alone; that of [{}] was written: {:.10g} {}",
                                 axis.name, *value, unit_name(joint)),
                     "nothing", joint.name);
    }
  for (const JointSection& motor : more.motors)
    if (const std::optional<double> value = end_of(motor, key); value && narrows(*value)) {
      end = value;
      note_motor(motor, key, *value, unit_name(joint), joint, machine);
    }
  if (end) return *end;
  const double chosen = sign * (joint.rotary ? kEndlessDeg : kEndlessMm);
  machine.note(ImportSpot::kJoint, section.place(key), fmt::format("[{}] has no {}", section.name, key),
               fmt::format("LinuxCNC then knows no end; here every joint has a range, and {} {} was chosen",
                           chosen, unit_name(joint)),
               "put the true end of travel here", joint.name);
  return chosen;
}

double positive(const JointSection& section, std::string_view key, const ImportedJoint& joint,
                ImportedMachine& machine) {
  constexpr double kLinuxcncsOwn = 1;
  const std::optional<double> value = section.length(key);
  if (value && !(*value > 0))
    throw ImportError(section.place(key), fmt::format("[{}]{} must be above 0", section.name, key));
  if (value) return *value;
  machine.note(ImportSpot::kJoint, section.place(key), fmt::format("[{}] has no {}", section.name, key),
               fmt::format("LinuxCNC takes {} of its units for it, and so it is here", kLinuxcncsOwn),
               "put the true value here", joint.name);
  return kLinuxcncsOwn * section.unit;
}

/// The axis of a joint alone. One without a limit has LinuxCNC's own, which hardly anybody means.
double axis_rate(const JointSection& axis, const char* key, double rate, const ImportedJoint& joint,
                 ImportedMachine& machine) {
  const std::optional<double> value = axis.length(key);
  if (value && !(*value > 0))
    throw ImportError(axis.place(key),
                      fmt::format("velocity and acceleration of [{}] must be above 0", axis.name));
  if (value) return std::min(rate, *value);
  if (rate > axis.unit && axis.is_there())
    machine.note(
        ImportSpot::kJoint, axis.place(key), fmt::format("[{}] has no {}", axis.name, key),
        "LinuxCNC takes 1 of its units for it, and is that slow; here the joint's limit holds alone, so "
        "that this machine may now be faster than before",
        "put the true value here", joint.name);
  return rate;
}

double path_rate(const IniFile& ini, const PathLimit& path, double rate, const ImportedJoint& joint,
                 ImportedMachine& machine) {
  const JointSection traj{ini, "TRAJ", machine.mm_per_unit};
  const std::optional<double> value = traj.length(path.key);
  if (value && !(*value > 0))
    throw ImportError(traj.place(path.key), fmt::format("[TRAJ]{} must be above 0", path.key));
  if (!value || *value >= rate) return rate;
  machine.note(
      ImportSpot::kJoint, traj.place(path.key), ini.find("TRAJ", path.key)->text(),
      fmt::format("LinuxCNC keeps every move below it; it is narrower than {} of {} ({:.10g} {}), and "
                  "became the limit of the joint",
                  path.joint_key, joint.name, rate, path.unit),
      "nothing", joint.name);
  return *value;
}

double read_rate(const JointSection& section, const LimitSections& more, const PathLimit& path,
                 ImportedJoint& joint, ImportedMachine& machine) {
  double rate = positive(section, path.joint_key, joint, machine);
  for (const JointSection& axis : more.axis) rate = axis_rate(axis, path.joint_key, rate, joint, machine);
  for (const JointSection& motor : more.motors) {
    if (!motor.is_there()) continue;
    const double of_motor = positive(motor, path.joint_key, joint, machine);
    if (of_motor < rate) note_motor(motor, path.joint_key, of_motor, rate_unit(path, joint), joint, machine);
    rate = std::min(rate, of_motor);
  }
  return joint.rotary ? rate : path_rate(section.ini, path, rate, joint, machine);
}

}  // namespace

void read_limits(const JointSection& section, const LimitSections& more, ImportedJoint& joint,
                 ImportedMachine& machine) {
  joint.min = read_end(section, more, "MIN_LIMIT", -1, joint, machine);
  joint.max = read_end(section, more, "MAX_LIMIT", 1, joint, machine);
  for (const PathLimit& path : kPathLimits)
    limit_of(path, joint) = read_rate(section, more, path, joint, machine);
  if (!(joint.min < joint.max))
    throw ImportError(
        section.place("MAX_LIMIT"),
        fmt::format("the range of {} is empty: MIN_LIMIT must be below MAX_LIMIT (of [{}] and of "
                    "its axis together)",
                    joint.name, section.name));
}

void note_path_limits(const IniFile& ini, ImportedMachine& machine) {
  for (const PathLimit& path : kPathLimits) {
    const IniEntry* entry = ini.find("TRAJ", path.key);
    if (!entry) continue;
    const double limit = ini.number("TRAJ", path.key).value_or(0) * machine.mm_per_unit;
    double squares = 0;
    int linear = 0;
    for (ImportedJoint& joint : machine.joints) {
      if (joint.rotary) continue;
      squares += limit_of(path, joint) * limit_of(path, joint);
      ++linear;
    }
    const double together = std::sqrt(squares);
    if (linear < 2 || together <= limit * (1 + 1e-9)) continue;
    machine.note(
        ImportSpot::kMachine, entry->key_place, entry->text(),
        fmt::format(
            "LinuxCNC keeps the whole path below it; here only the single joints have limits, so that "
            "this machine may now move faster along its path than before: up to {:.4g} {} where "
            "linear joints move together, instead of {:.4g}",
            together, path.unit, limit),
        fmt::format("{:.4g} for each of the linear joints keeps every path below the old limit{}",
                    limit / std::sqrt(linear), path.bounded_by));
  }
}

}  // namespace trn
