#include "app/import/joint_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/import/import_place.h"
#include "core/letter_case.h"

namespace trn {

namespace {

constexpr double kJerkTime_s = 0.05;  // docs/config.md: a frequent choice
constexpr double kEndlessDeg = 36000, kEndlessMm = 10000;
constexpr double kLimitsNone = 1e9;  // LinuxCNC's own default is 1e99

/// Reads the numbers of one section in mm or degrees, by the joint's kind.
struct JointSection {
  const IniFile& ini;
  std::string name;
  double unit;

  std::optional<double> length(std::string_view key) const {
    const std::optional<double> value = ini.number(name, key);
    return value ? std::optional(*value * unit) : std::nullopt;
  }
  ImportPlace place(std::string_view key) const {
    const IniEntry* entry = ini.find(name, key);
    return entry ? entry->value_place : ini.place_of(name);
  }
};

bool read_rotary(const IniFile& ini, const std::string& section, char letter, ImportedMachine& machine) {
  const bool should = letter == 'A' || letter == 'B' || letter == 'C';
  const IniEntry* entry = ini.find(section, "TYPE");
  if (!entry) {
    if (should)
      machine.note(ImportSpot::kJoint, ini.place_of(section), fmt::format("[{}] has no TYPE", section),
                   "LinuxCNC takes it as LINEAR; a rotary axis was made of it, as its letter says", "nothing",
                   std::string(1, letter));
    return should;
  }
  const std::string type = lower_case(ini.text(section, "TYPE"));
  if (type != "linear" && type != "angular")
    throw ImportError(entry->value_place,
                      fmt::format("TYPE = {}: LINEAR or ANGULAR would be right", entry->value.substr(0, 40)));
  if (letter == '-' || (type == "angular") == should) return type == "angular";
  const ImportPlace& place = entry->value_place;
  if (should)
    throw ImportRefusal(place,
                        fmt::format("[{}] moves axis {} and is LINEAR; A, B and C turn here. If it turns, "
                                    "ANGULAR would be right",
                                    section, letter));
  throw ImportError(place,
                    fmt::format("[{}] moves axis {} and is ANGULAR; LINEAR would be right", section, letter));
}

double positive(const JointSection& section, std::string_view key, double fallback, ImportedJoint& joint,
                ImportedMachine& machine) {
  const std::optional<double> value = section.length(key);
  if (value && !(*value > 0))
    throw ImportError(section.place(key), fmt::format("[{}]{} must be above 0", section.name, key));
  if (value) return *value;
  machine.note(ImportSpot::kJoint, section.place(key), fmt::format("[{}] has no {}", section.name, key),
               fmt::format("LinuxCNC takes {} of its units for it, and so it is here", fallback),
               "put the true value here", joint.name);
  return fallback * section.unit;
}

double limit_of(const JointSection& section, std::string_view key, double sign, ImportedJoint& joint,
                ImportedMachine& machine) {
  const std::optional<double> value = section.length(key);
  if (value && std::abs(*value) < kLimitsNone) return *value;
  const double chosen = sign * (joint.rotary ? kEndlessDeg : kEndlessMm);
  machine.note(
      ImportSpot::kJoint, section.place(key), fmt::format("[{}] has no {}", section.name, key),
      fmt::format("LinuxCNC then knows no end; here every joint has a range, and {} was chosen", chosen),
      "put the true end of travel here", joint.name);
  return chosen;
}

void read_range(const IniFile& ini, const JointSection& section, const std::string& axis,
                ImportedJoint& joint, ImportedMachine& machine) {
  joint.min = limit_of(section, "MIN_LIMIT", -1, joint, machine);
  joint.max = limit_of(section, "MAX_LIMIT", 1, joint, machine);
  joint.velocity = positive(section, "MAX_VELOCITY", 1, joint, machine);
  joint.acceleration = positive(section, "MAX_ACCELERATION", 1, joint, machine);
  // A letter that is one joint's alone has two pairs of limits, of which the narrower holds.
  if (!axis.empty() && ini.has_section(axis)) {
    const JointSection of_axis{ini, axis, section.unit};
    joint.min = std::max(joint.min, of_axis.length("MIN_LIMIT").value_or(joint.min));
    joint.max = std::min(joint.max, of_axis.length("MAX_LIMIT").value_or(joint.max));
    joint.velocity = std::min(joint.velocity, of_axis.length("MAX_VELOCITY").value_or(joint.velocity));
    joint.acceleration =
        std::min(joint.acceleration, of_axis.length("MAX_ACCELERATION").value_or(joint.acceleration));
    if (!(joint.velocity > 0) || !(joint.acceleration > 0))
      throw ImportError(of_axis.place(joint.velocity > 0 ? "MAX_ACCELERATION" : "MAX_VELOCITY"),
                        fmt::format("velocity and acceleration of [{}] must be above 0", axis));
  }
  if (!(joint.min < joint.max))
    throw ImportError(
        section.place("MAX_LIMIT"),
        fmt::format("the range of {} is empty: MIN_LIMIT must be below MAX_LIMIT (of [{}] and of "
                    "its axis together)",
                    joint.name, section.name));
}

void choose_jerk(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  joint.jerk = joint.acceleration / kJerkTime_s;
  if (const std::optional<double> jerk = section.length("MAX_JERK"); jerk && *jerk > 0) {
    joint.jerk = *jerk;
    return;
  }
  machine.note(ImportSpot::kJoint, section.place("MAX_ACCELERATION"), fmt::format("jerk of {}", joint.name),
               fmt::format("LinuxCNC knows none; the acceleration over {} s was chosen", kJerkTime_s),
               "a smaller one is gentler to the machine, a greater one quicker", joint.name);
}

void read_homing(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  joint.home = section.length("HOME").value_or(0);
  joint.switch_at = section.length("HOME_OFFSET").value_or(0);
  const double search = section.length("HOME_SEARCH_VEL").value_or(0);
  const double latch = section.length("HOME_LATCH_VEL").value_or(0);
  joint.search_speed = std::abs(search);
  joint.latch_speed = std::abs(latch);
  joint.searches = search != 0 || latch != 0;
  joint.following_error = section.length("FERROR").value_or(0);
  joint.backlash = std::abs(section.length("BACKLASH").value_or(0));
  if (const std::optional<double> sequence = section.ini.number(section.name, "HOME_SEQUENCE"))
    joint.sequence = static_cast<int>(std::clamp(*sequence, -100.0, 100.0));
  if (search > 0)
    machine.note(ImportSpot::kDrives, section.place("HOME_SEARCH_VEL"),
                 fmt::format("[{}]HOME_SEARCH_VEL is positive", section.name),
                 "simulated drives search their switch downwards; real ones as their homing method says",
                 "on CANopen choose homing_method (17 to 30: switches at either end)");
}

void read_scale(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  for (const char* key : {"SCALE", "OUTPUT_SCALE", "STEP_SCALE", "INPUT_SCALE", "ENCODER_SCALE"}) {
    const IniEntry* entry = section.ini.find(section.name, key);
    if (!entry || joint.counts) continue;
    // Some have an offset or a remark behind it.
    const std::string first = entry->value.substr(0, entry->value.find_first_of(" \t"));
    const std::optional<double> counts = whole_number_text(first);
    if (counts && *counts != 0)
      joint.counts = *counts / section.unit;
    else
      machine.note(ImportSpot::kDrives, entry->value_place, entry->text(),
                   "this is no number of counts for a unit of the axis",
                   "with real drives, counts_per_mm or counts_per_deg");
  }
}

ImportedJoint read_joint(const IniFile& ini, int number, const std::string& name, char letter, bool trivial,
                         ImportedMachine& machine) {
  const std::string section = fmt::format("JOINT_{}", number);
  if (!ini.has_section(section)) {
    const bool old = ini.has_section(fmt::format("AXIS_{}", number));
    throw ImportError(
        ini.place_of("KINS"),
        fmt::format("axis {} is joint {}, and there is no section [{}]{}", name, number, section,
                    old ? "; this INI is of a LinuxCNC before 2.8: its update_ini makes a new one" : ""));
  }
  ImportedJoint joint;
  joint.name = name;
  joint.number = number;
  joint.rotary = read_rotary(ini, section, letter, machine);
  const JointSection keys{ini, section, joint.rotary ? machine.deg_per_unit : machine.mm_per_unit};
  read_range(ini, keys, trivial ? fmt::format("AXIS_{}", letter) : "", joint, machine);
  choose_jerk(keys, joint, machine);
  read_homing(keys, joint, machine);
  read_scale(keys, joint, machine);
  return joint;
}

void note_axis_limits(const IniFile& ini, char letter, const ImportedJoint& joint, ImportedMachine& machine) {
  const JointSection axis{ini, fmt::format("AXIS_{}", letter),
                          joint.rotary ? machine.deg_per_unit : machine.mm_per_unit};
  if (!ini.has_section(axis.name)) return;
  const double low = axis.length("MIN_LIMIT").value_or(joint.min);
  const double high = axis.length("MAX_LIMIT").value_or(joint.max);
  const double velocity = axis.length("MAX_VELOCITY").value_or(joint.velocity);
  const double acceleration = axis.length("MAX_ACCELERATION").value_or(joint.acceleration);
  const bool wider = low <= joint.min && high >= joint.max;
  if (wider && velocity >= joint.velocity && acceleration >= joint.acceleration) return;
  machine.note(ImportSpot::kJoint, ini.place_of(axis.name),
               fmt::format("[{}] from {:.10g} to {:.10g}, velocity {:.10g}, acceleration {:.10g}", axis.name,
                           low, high, velocity, acceleration),
               "it bounds the programmed position and its motion; here the limits of the joints alone do",
               "narrow the joint if it matters", joint.name);
}

void leave_out(const IniFile& ini, int number, char letter, bool second, ImportedMachine& machine) {
  const std::string section = fmt::format("JOINT_{}", number);
  const ImportPlace place = ini.place_of(ini.has_section(section) ? section : "KINS");
  std::string values;
  for (const IniEntry& entry : ini.entries())
    if (entry.section == section || (!second && entry.section == fmt::format("AXIS_{}", letter))) {
      entry.used = true;
      values += fmt::format("{}{} = {}", values.empty() ? "" : ", ", entry.key, entry.value);
    }
  if (second)
    machine.note(ImportSpot::kJoint, place, fmt::format("[{}], a second motor of axis {}", section, letter),
                 fmt::format("simulated drives have one motor for each joint; left out are: {}",
                             values.empty() ? "no entries" : values),
                 "with real drives on CANopen, one [[drives.node]] for each motor and a [[drives.gantry]]; "
                 "its square_mm is "
                 "what the two HOME_OFFSETs differ by (docs/drives.md)",
                 std::string(1, letter));
  else
    machine.note(ImportSpot::kMachine, place, fmt::format("[{}], axis {}", section, letter),
                 "no machine here has axes U, V and W",
                 letter == 'W' ? "if W was the tool's length, G43 with the tool table is"
                               : "programs may not use its word");
}

/// Of trivkins without coordinates=: a joint between others that the machine does not have, as Y of a lathe.
bool is_gap(const IniFile& ini, std::size_t number, char letter) {
  const IniEntry* coordinates = ini.find("TRAJ", "COORDINATES");
  return coordinates && !ini.has_section(fmt::format("JOINT_{}", number)) &&
         lower_case(coordinates->value).find(lower_case(std::string(1, letter))) == std::string::npos;
}

void read_legs(const IniFile& ini, ImportedMachine& machine) {
  if (ini.number("KINS", "JOINTS").value_or(6) != 6)
    throw ImportError(ini.find("KINS", "JOINTS")->value_place,
                      "genhexkins has six legs: JOINTS = 6 would be right");
  for (int i = 0; i < 6; ++i) {
    machine.joints.push_back(read_joint(ini, i, fmt::format("leg{}", i + 1), '-', false, machine));
    if (machine.joints.back().rotary)
      throw ImportError(ini.place_of(fmt::format("JOINT_{}", i)), "a leg of genhexkins is LINEAR");
  }
  for (const char letter : std::string_view("XYZABC")) {
    const std::string section = fmt::format("AXIS_{}", letter);
    if (!ini.has_section(section)) continue;
    for (const IniEntry& entry : ini.entries())
      if (entry.section == section) entry.used = true;
    machine.note(ImportSpot::kKinematics, ini.place_of(section), fmt::format("[{}]", section),
                 "limits of the programmed position; here the legs and their joints bound it",
                 "'trunnion workspace' shows what is reached");
  }
}

}  // namespace

void read_joints(const IniFile& ini, const KinematicsModule& module, ImportedMachine& machine) {
  if (module.name == "genhexkins") return read_legs(ini, machine);
  const IniEntry* count_entry = ini.find("KINS", "JOINTS");
  const ImportPlace& count_place = count_entry ? count_entry->value_place : module.place;
  const double count = ini.number("KINS", "JOINTS").value_or(static_cast<double>(module.letters.size()));
  if (!(count >= 1 && count <= 16 && count == std::floor(count)))
    throw ImportError(count_place, "the number of joints must be a whole number from 1 to 16");
  const bool defaulted = module.name == "trivkins" && module.letters.size() == 9;
  if (!defaulted && count < static_cast<double>(module.letters.size()))
    throw ImportError(count_place, fmt::format("JOINTS = {} but {} has {} axes ({})", count, module.name,
                                               module.letters.size(), module.letters));
  const bool trivial = module.name == "trivkins";
  std::string seen;
  for (std::size_t i = 0; i < std::min(module.letters.size(), static_cast<std::size_t>(count)); ++i) {
    const char letter = module.letters[i];
    if (defaulted && is_gap(ini, i, letter)) {
      machine.note(ImportSpot::kMachine, ini.place_of("TRAJ"), fmt::format("joint {}, axis {}", i, letter),
                   "neither [TRAJ]COORDINATES nor a section [JOINT_N] names it", "nothing");
      continue;
    }
    const bool second = seen.find(letter) != std::string::npos;
    if (second || std::string_view("UVW").find(letter) != std::string_view::npos) {
      leave_out(ini, static_cast<int>(i), letter, second, machine);
      continue;
    }
    seen += letter;
    const bool own = trivial || std::string_view("ABC").find(letter) != std::string_view::npos;
    machine.joints.push_back(
        read_joint(ini, static_cast<int>(i), std::string(1, letter), letter, own, machine));
    if (!own) note_axis_limits(ini, letter, ImportedJoint(machine.joints.back()), machine);
  }
  if (machine.joints.empty())
    throw ImportRefusal(module.place,
                        fmt::format("of the axes {} none is X, Y, Z, A, B or C", module.letters));
  for (int i = static_cast<int>(module.letters.size()); i < static_cast<int>(count); ++i)
    machine.note(
        ImportSpot::kMachine,
        ini.place_of(ini.has_section(fmt::format("JOINT_{}", i)) ? fmt::format("JOINT_{}", i) : "KINS"),
        fmt::format("[JOINT_{}]", i), "an extra joint that no axis moves, by HAL alone",
        "it needs a control of its own");
}

}  // namespace trn
