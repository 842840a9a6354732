#include "app/import/joint_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/import/homing_reader.h"
#include "app/import/import_place.h"
#include "app/import/joint_section.h"
#include "app/import/limit_reader.h"
#include "core/letter_case.h"

namespace trn {

namespace {

constexpr double kJerkTime_s = 0.05;  // docs/config.md: a frequent choice
constexpr double kBacklashMax = 5;    // of [[corrections.joint_table.joint]], mm or degrees

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

void read_backlash(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  const double backlash = std::abs(section.length("BACKLASH").value_or(0));
  if (backlash > kBacklashMax) {
    machine.note(
        ImportSpot::kJoint, section.place("BACKLASH"), section.ini.find(section.name, "BACKLASH")->text(),
        fmt::format("{:.10g} {} are more than the correction takes, {}; no backlash was carried over",
                    backlash, joint.rotary ? "degrees" : "mm", kBacklashMax),
        "look whether the number is right; [corrections.joint_table] has backlash_mm and backlash_deg",
        joint.name);
    return;
  }
  joint.backlash = backlash;
}

/// Counts of an encoder come first. OUTPUT_SCALE is none: it is the volts of a drive with an analog input.
void read_scale(const JointSection& section, ImportedJoint& joint, ImportedMachine& machine) {
  std::string taken;
  for (const char* key : {"ENCODER_SCALE", "INPUT_SCALE", "STEP_SCALE", "SCALE", "OUTPUT_SCALE"}) {
    const IniEntry* entry = section.ini.find(section.name, key);
    if (!entry) continue;
    // Some have an offset or a remark behind it.
    const std::string first = entry->value.substr(0, entry->value.find_first_of(" \t"));
    const std::optional<double> counts = whole_number_text(first);
    const bool analog = std::string_view(key) == "OUTPUT_SCALE";
    if (counts && *counts != 0 && !analog && !joint.counts) {
      joint.counts = *counts / section.unit;
      taken = key;
      continue;
    }
    std::string why = "this is no number of counts for a unit of the axis";
    if (analog)
      why = "this is the scale of an analog output, and no number of counts";
    else if (joint.counts)
      why = fmt::format("the counts of {} were taken, since a drive counts as its encoder does", taken);
    machine.note(ImportSpot::kDrives, entry->value_place, entry->text(), why,
                 analog || joint.counts ? "look whether the drive counts so: counts_per_mm or counts_per_deg"
                                        : "with real drives, counts_per_mm or counts_per_deg");
  }
}

[[noreturn]] void miss_section(const IniFile& ini, int number, const std::string& name,
                               const std::string& section) {
  std::string hint;
  if (ini.has_section(fmt::format("AXIS_{}", number)))
    hint = "; this INI is of a LinuxCNC before 2.8: its update_ini makes a new one";
  for (const IniEntry& entry : ini.entries())
    if (upper_case(entry.section) == section)
      hint = fmt::format("; [{}] is there, but small letters are others than capital ones", entry.section);
  throw ImportError(ini.place_of("KINS"), fmt::format("axis {} is joint {}, and there is no section [{}]{}",
                                                      name, number, section, hint));
}

ImportedJoint read_joint(const IniFile& ini, int number, const std::string& name, char letter, bool trivial,
                         const std::vector<int>& motors, ImportedMachine& machine) {
  const std::string section = fmt::format("JOINT_{}", number);
  if (!ini.has_section(section)) miss_section(ini, number, name, section);
  ImportedJoint joint;
  joint.name = name;
  joint.number = number;
  joint.rotary = read_rotary(ini, section, letter, machine);
  const double unit = joint.rotary ? machine.deg_per_unit : machine.mm_per_unit;
  const JointSection keys{ini, section, unit};
  // A letter that is one joint's alone has two pairs of limits, of which the narrower holds.
  LimitSections more;
  if (trivial) more.axis.push_back({ini, fmt::format("AXIS_{}", letter), unit});
  for (const int motor : motors) more.motors.push_back({ini, fmt::format("JOINT_{}", motor), unit});
  read_limits(keys, more, joint, machine);
  choose_jerk(keys, joint, machine);
  read_backlash(keys, joint, machine);
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
    machine.joints.push_back(read_joint(ini, i, fmt::format("leg{}", i + 1), '-', false, {}, machine));
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

void read_chain(const IniFile& ini, const KinematicsModule& module, ImportedMachine& machine) {
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
  const std::size_t joints = std::min(module.letters.size(), static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < joints; ++i) {
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
    std::vector<int> motors;
    for (std::size_t k = i + 1; k < joints; ++k)
      if (module.letters[k] == letter) motors.push_back(static_cast<int>(k));
    machine.joints.push_back(
        read_joint(ini, static_cast<int>(i), std::string(1, letter), letter, own, motors, machine));
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

/// The correction keeps a strip of the range free, and LinuxCNC does not: see write_joint.
void note_backlash_strips(const IniFile& ini, ImportedMachine& machine) {
  for (const ImportedJoint& joint : machine.joints) {
    if (joint.backlash == 0) continue;
    const IniEntry* entry = ini.find(fmt::format("JOINT_{}", joint.number), "BACKLASH");
    machine.note(
        ImportSpot::kJoint, entry->key_place, entry->text(),
        fmt::format("its correction keeps {:.10g} {} at either end of the range for itself, so the range "
                    "was written wider by as much; programs reach what MIN_LIMIT and MAX_LIMIT say",
                    machine.backlash_strip(joint.rotary), joint.rotary ? "degrees" : "mm"),
        "nothing", joint.name);
  }
}

}  // namespace

void read_joints(const IniFile& ini, const KinematicsModule& module, ImportedMachine& machine) {
  if (module.name == "genhexkins")
    read_legs(ini, machine);
  else
    read_chain(ini, module, machine);
  note_path_limits(ini, machine);
  note_backlash_strips(ini, machine);
}

}  // namespace trn
