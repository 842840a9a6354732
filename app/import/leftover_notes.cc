#include "app/import/leftover_notes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "app/import/import_place.h"
#include "app/import/key_names.h"
#include "core/letter_case.h"

namespace trn {

namespace {

/// What a key that is left means; `key` "" is every other one of the section, "*" in a section every number.
struct KeyMeaning {
  const char* section;
  const char* key;
  ImportSpot spot;
  const char* why;
  const char* to_do;
};

constexpr const char* kNothing = "nothing";

constexpr KeyMeaning kKeyMeanings[] = {
    {"JOINT_*", "MIN_FERROR", ImportSpot::kDrives, "one following error holds at every speed",
     "following_error_mm of the drive"},
    {"JOINT_*", "HOME_USE_INDEX", ImportSpot::kDrives, "the homing method of the drive says it",
     "homing_method"},
    {"JOINT_*", "HOME_INDEX_NO_ENCODER_RESET", ImportSpot::kDrives, "the drive's own homing does it",
     kNothing},
    {"JOINT_*", "HOME_IGNORE_LIMITS", ImportSpot::kDrives, "the drive's own homing does it",
     "homing_method with the limit switch"},
    {"JOINT_*", "HOME_IS_SHARED", ImportSpot::kDrives, "each drive homes by itself",
     "home joints that share a switch one after the other"},
    {"JOINT_*", "HOME_FINAL_VEL", ImportSpot::kDrives, "nothing moves to HOME behind the search by itself",
     "a move after homing"},
    {"JOINT_*", "HOME_ABSOLUTE_ENCODER", ImportSpot::kDrives, "the drive says it",
     "absolute = true of the drive"},
    {"JOINT_*", "VOLATILE_HOME", ImportSpot::kDrives, "homing is lost when the drive says so", kNothing},
    {"JOINT_*", "LOCKING_INDEXER", ImportSpot::kJoint, "no joint is locked and unlocked here",
     "M codes of your own for the lock"},
    {"JOINT_*", "COMP_FILE", ImportSpot::kJoint, "the screw's table is not read",
     "[corrections.joint_table] has at_mm, forward_mm and backward_mm (docs/corrections.md)"},
    {"JOINT_*", "COMP_FILE_TYPE", ImportSpot::kJoint, "goes with COMP_FILE", kNothing},
    {"JOINT_*", "", ImportSpot::kDrives,
     "a number for HAL's step generator, servo loop or encoder: the drives close "
     "the loop here",
     "parameters of the drive itself"},
    {"AXIS_*", "OFFSET_AV_RATIO", ImportSpot::kEnd, "there are no external offsets", kNothing},
    {"AXIS_*", "", ImportSpot::kEnd, "limits that no joint has alone", kNothing},
    {"SPINDLE_*", "", ImportSpot::kIo, "the spindle's own drive does this", "parameters of the inverter"},
    {"TRAJ", "HOME", ImportSpot::kEnd, "the joints' HOME says it", kNothing},
    {"TRAJ", "COORDINATES", ImportSpot::kEnd, "the joints' words say it", kNothing},
    {"TRAJ", "NO_FORCE_HOMING", ImportSpot::kDrives, "motion needs homed drives here, always",
     "drives with absolute encoders need none"},
    {"TRAJ", "POSITION_FILE", ImportSpot::kDrives,
     "positions are not kept in a file: drives without absolute encoders "
     "home after power-on",
     "absolute = true of a drive that knows its place"},
    {"TRAJ", "MAX_ANGULAR_VELOCITY", ImportSpot::kEnd,
     "it bounds how fast the user interface jogs, and no move of a program; the joints' limits bound both",
     kNothing},
    {"TRAJ", "SPINDLES", ImportSpot::kIo, "a machine has one spindle", kNothing},
    {"TRAJ", "", ImportSpot::kEnd,
     "the trajectory planner is another one: look-ahead, blending and jerk as "
     "docs/planner.md tells",
     kNothing},
    {"RS274NGC", "USER_M_PATH", ImportSpot::kProgram, "M100 to M199 run no programs of the host",
     "[[program.m_code]] with a sub-program or an output"},
    {"RS274NGC", "ON_ABORT_COMMAND", ImportSpot::kProgram, "nothing is run when a program ends early",
     kNothing},
    {"RS274NGC", "HAL_PIN_VARS", ImportSpot::kProgram, "#<_hal[...]> does not exist", "M66 reads an input"},
    {"RS274NGC", "INI_VARS", ImportSpot::kProgram, "#<_ini[...]> does not exist", "write the number"},
    {"RS274NGC", "", ImportSpot::kProgram, "the interpreter has no such switch", "docs/gcode.md"},
    {"PYTHON", "", ImportSpot::kProgram, "the interpreter runs no Python", "sub-programs"},
    {"EMCIO", "TOOL_CHANGE_POSITION", ImportSpot::kToolChange, "M6 moves nothing by itself",
     "G53 G0 before M6, or a sub-program by confirm = \"sub-program\""},
    {"EMCIO", "TOOL_CHANGE_AT_G30", ImportSpot::kToolChange, "M6 moves nothing by itself", "G30 before M6"},
    {"EMCIO", "TOOL_CHANGE_QUILL_UP", ImportSpot::kToolChange, "M6 moves nothing by itself",
     "G53 G0 Z before M6"},
    {"EMCIO", "TOOL_CHANGE_WITH_SPINDLE_ON", ImportSpot::kToolChange, "M6 always stops the spindle",
     kNothing},
    {"EMCIO", "RANDOM_TOOLCHANGER", ImportSpot::kToolChange, "tools keep their pockets here",
     "a sub-program"},
    {"EMCIO", "DB_PROGRAM", ImportSpot::kToolChange, "tools come from a table, not from a program",
     "--tools FILE"},
    {"EMCIO", "", ImportSpot::kEnd, "there is no process for inputs and outputs beside the tick", kNothing},
    {"HALUI", "MDI_COMMAND", ImportSpot::kEnd, "buttons of halui", "'trunnion mdi' from any program"},
    {"HALUI", "", ImportSpot::kEnd, "there is no halui", "commands of 'trunnion' over the socket"},
    {"DISPLAY", "LATHE", ImportSpot::kProgram,
     "diameters (G7), threads (G33, G76) and G96 are here, the cycles G70 to G72 are not",
     "G18 in the program's first lines; write the cycles out in CAM"},
    {"DISPLAY", "", ImportSpot::kEnd, "keys of the user interface",
     "'trunnion monitor', or a client of your own (hal/lcm/*.lcm)"},
    {"FILTER", "", ImportSpot::kEnd, "programs are read as they are", "run the filter by hand"},
    {"HAL", "", ImportSpot::kEnd, "there is no HAL", "docs/from_linuxcnc.md"},
    {"EMC", "", ImportSpot::kEnd, "keys of LinuxCNC's own start", kNothing},
    {"EMCMOT", "BASE_PERIOD", ImportSpot::kEnd, "no thread makes steps in software", "drives that make them"},
    {"EMCMOT", "", ImportSpot::kEnd, "keys of LinuxCNC's motion module", kNothing},
    {"TASK", "", ImportSpot::kEnd, "keys of LinuxCNC's task", kNothing},
    {"KINS", "", ImportSpot::kKinematics, "keys of LinuxCNC's motion module", kNothing},
    {"APPLICATIONS", "", ImportSpot::kEnd, "programs that LinuxCNC starts beside itself",
     "start them yourself"},
};

bool section_matches(std::string_view pattern, std::string_view section) {
  return pattern.ends_with('*') ? section.starts_with(pattern.substr(0, pattern.size() - 1))
                                : pattern == section;
}

KeyMeaning meaning_of(const IniEntry& entry) {
  for (const KeyMeaning& row : kKeyMeanings)
    if (section_matches(row.section, entry.section) && (row.key[0] == '\0' || entry.key == row.key))
      return row;
  return {"", "", ImportSpot::kEnd,
          "a section that LinuxCNC itself does not read: of HAL, or of a user interface", kNothing};
}

/// A name that LinuxCNC knows in capital letters alone, and passes over as it stands.
bool note_other_case(const IniFile& ini, const IniEntry& entry, ImportedMachine& machine) {
  const std::string meant = key_in_capitals(entry.section, entry.key);
  if (meant.empty()) return false;
  const IniEntry* real = nullptr;
  for (const IniEntry& one : ini.entries())
    if (!real && fmt::format("[{}]{}", one.section, one.key) == meant) real = &one;
  machine.note(
      ImportSpot::kMachine, entry.key_place, entry.text(),
      fmt::format("small letters are others than capital ones in an INI: LinuxCNC looks for {} and passes "
                  "over this line, and so does the import{}",
                  meant, real ? fmt::format("; {} is there", real->text()) : ""),
      fmt::format("if it was meant, write {} and import again", meant));
  return true;
}

void note_ini(const IniFile& ini, ImportedMachine& machine) {
  // Keys of one section for which the same is to be said make one note.
  struct Group {
    KeyMeaning meaning;
    ImportPlace place;
    std::string section;
    std::vector<std::string> texts;
  };
  std::vector<Group> groups;
  std::map<std::pair<std::string, std::string>, std::size_t> at;
  for (const IniEntry& entry : ini.entries()) {
    if (entry.used) continue;
    if (note_other_case(ini, entry, machine)) continue;
    const KeyMeaning meaning = meaning_of(entry);
    const auto [found, fresh] = at.emplace(std::pair(entry.section, meaning.why), groups.size());
    if (fresh) groups.push_back({meaning, entry.key_place, entry.section, {}});
    groups[found->second].texts.push_back(fmt::format("{} = {}", entry.key, entry.value));
  }
  for (const Group& group : groups) {
    std::string joint;
    if (group.meaning.spot == ImportSpot::kJoint)
      for (const ImportedJoint& one : machine.joints)
        if (group.section == fmt::format("JOINT_{}", one.number)) joint = one.name;
    machine.note(
        joint.empty() && group.meaning.spot == ImportSpot::kJoint ? ImportSpot::kEnd : group.meaning.spot,
        group.place, fmt::format("[{}] {}", group.section, fmt::join(group.texts, ", ")), group.meaning.why,
        group.meaning.to_do, joint);
  }
}

/// A subject of signals: those that have a pin whose name begins so.
struct SignalSubject {
  const char* prefix;
  ImportSpot spot;
  const char* subject;
  const char* to_do;
};

constexpr SignalSubject kSignalSubjects[] = {
    {"iocontrol.0.emc-enable-in", ImportSpot::kEnd, "the emergency stop's chain",
     "wire it to the drives' own safe inputs (STO): no software replaces it (docs/safety.md)"},
    {"iocontrol.0.user-enable-out", ImportSpot::kEnd, "the emergency stop's chain",
     "wire it to the drives' own safe inputs (STO): no software replaces it (docs/safety.md)"},
    {"iocontrol.0.user-request-enable", ImportSpot::kEnd, "the emergency stop's chain",
     "'trunnion estop' and 'reset'"},
    {"iocontrol.0.tool", ImportSpot::kToolChange, "the tool change", "[tool_change] (docs/operator.md)"},
    {"iocontrol.0.coolant", ImportSpot::kIo, "coolant", "[io] mist and flood, on Modbus"},
    {"iocontrol.0.lube", ImportSpot::kIo, "lubrication", "an output of the PLC"},
    {"motion.probe-input", ImportSpot::kIo, "the touch probe",
     "[drives] probe = \"drive\" on CANopen; simulated in [io.probe]"},
    {"motion.digital-", ImportSpot::kIo, "digital inputs and outputs (M62 to M66)",
     "[io] digital_inputs and digital_outputs, on Modbus"},
    {"motion.analog-", ImportSpot::kIo, "analog inputs and outputs (M66 to M68)",
     "[io] analog_inputs and analog_outputs, on Modbus"},
    {"spindle.", ImportSpot::kIo, "the spindle", "[io.spindle] (docs/config.md)"},
    {"motion.spindle", ImportSpot::kIo, "the spindle, by its names before 2.8",
     "[io.spindle] (docs/config.md)"},
    {"motion.", ImportSpot::kEnd, "states of the motion module",
     "'trunnion status --json', telemetry over LCM"},
    {"joint.", ImportSpot::kDrives, "the motors: commands, feedback, switches, amplifiers",
     "[drives] type = \"canopen\" (docs/drives.md)"},
    {"axis.", ImportSpot::kEnd, "jog wheels and positions of the axes",
     "'trunnion jog' from a panel's program"},
    {"halui.", ImportSpot::kEnd, "buttons and lamps of a panel", "commands of 'trunnion' over the socket"},
    {"pyvcp.", ImportSpot::kEnd, "the user interface",
     "'trunnion monitor', or a client of your own (hal/lcm/*.lcm)"},
    {"gladevcp.", ImportSpot::kEnd, "the user interface",
     "'trunnion monitor', or a client of your own (hal/lcm/*.lcm)"},
};

void note_signals(const HalSetup& hal, ImportedMachine& machine) {
  std::set<std::string> told;
  std::map<std::string, std::vector<std::string>> names;
  std::vector<std::pair<const SignalSubject*, ImportPlace>> order;
  for (const SignalSubject& subject : kSignalSubjects)
    for (const HalSignal* signal : hal.signals_of(subject.prefix)) {
      if (!told.insert(signal->name).second) continue;
      std::vector<std::string>& list = names[subject.subject];
      if (list.empty()) order.emplace_back(&subject, signal->place);
      list.push_back(fmt::format("{} (line {})", signal->name, signal->place.line));
    }
  for (const auto& [subject, place] : order)
    machine.note(
        subject->spot, place,
        fmt::format("signals of HAL for {}: {}", subject->subject, fmt::join(names[subject->subject], ", ")),
        "nothing of HAL is run here", subject->to_do);
  std::vector<std::string> rest;
  ImportPlace first;
  for (const HalSignal& signal : hal.signals()) {
    if (told.contains(signal.name)) continue;
    if (rest.empty()) first = signal.place;
    rest.push_back(fmt::format("{} (line {})", signal.name, signal.place.line));
  }
  if (!rest.empty())
    machine.note(ImportSpot::kEnd, first, fmt::format("other signals of HAL: {}", fmt::join(rest, ", ")),
                 "nothing of HAL is run here", "logic belongs to a PLC, or to a program beside the daemon");
}

bool is_core_module(const HalModule& module) {
  return module.name == "motmod" || module.name == "threads" || module.name == "tpmod" ||
         module.name == "homemod" || module.name.ends_with("kins");
}

void note_modules(const HalSetup& hal, ImportedMachine& machine) {
  for (const bool realtime : {true, false}) {
    std::vector<std::string> names;
    ImportPlace first;
    for (const HalModule& module : hal.modules()) {
      if (module.realtime != realtime || (realtime && is_core_module(module))) continue;
      if (names.empty()) first = module.place;
      names.push_back(fmt::format("{} (line {})", module.name, module.place.line));
    }
    if (names.empty()) continue;
    machine.note(
        realtime ? ImportSpot::kDrives : ImportSpot::kEnd, first,
        fmt::format("{}: {}", realtime ? "modules by loadrt" : "programs by loadusr", fmt::join(names, ", ")),
        realtime ? "drivers and parts of HAL are not run here; the drives are simulated"
                 : "programs beside LinuxCNC are not started",
        realtime ? "real drives: [drives] type = \"canopen\" or \"modbus\" (docs/drives.md)" : kNothing);
  }
  if (hal.functions() > 0)
    machine.note(ImportSpot::kEnd, {hal.files().empty() ? machine.source : hal.files().front()},
                 fmt::format("{} functions by addf", hal.functions()),
                 "there are no threads to add functions to: the "
                 "tick does the same things in the same order in every period",
                 kNothing);
  std::vector<std::string> pins;
  ImportPlace first;
  for (const auto& [pin, value] : hal.parameters()) {
    if (pin.find("kins.") != std::string::npos) continue;
    if (pins.empty()) first = value.place;
    pins.push_back(fmt::format("{} = {}", pin, value.text));
  }
  if (!pins.empty())
    machine.note(ImportSpot::kDrives, first, fmt::format("pins that are set: {}", fmt::join(pins, ", ")),
                 "parameters of modules that are not run here",
                 "parameters of the drives and inverters themselves");
}

/// The same key again in a section that has each key once.
void note_repeated(const IniFile& ini, ImportedMachine& machine) {
  std::map<std::pair<std::string, std::string>, std::string> first;
  for (const IniEntry& entry : ini.entries()) {
    bool single = false;
    for (const char* section : {"JOINT_*", "AXIS_*", "SPINDLE_*", "KINS", "TRAJ", "EMCMOT", "EMCIO"})
      single = single || section_matches(section, entry.section);
    if (!single || !entry.used) continue;
    const auto [found, fresh] = first.emplace(std::pair(entry.section, entry.key), entry.value);
    if (!fresh && found->second != entry.value)
      machine.note(ImportSpot::kEnd, entry.key_place, entry.text(),
                   fmt::format("the key is there before with {}, and the first one counts", found->second),
                   "look which of them is meant");
  }
}

void note_gaps(const std::vector<ImportGap>& gaps, ImportedMachine& machine) {
  for (const ImportGap& gap : gaps)
    machine.note(ImportSpot::kEnd, gap.place, gap.what, gap.why,
                 "look whether it says something of the machine, and put that into this config");
}

}  // namespace

void note_leftovers(const IniFile& ini, const HalSetup& hal, ImportedMachine& machine) {
  note_gaps(ini.gaps(), machine);
  note_gaps(hal.gaps(), machine);
  note_repeated(ini, machine);
  note_modules(hal, machine);
  note_signals(hal, machine);
  note_ini(ini, machine);
}

}  // namespace trn
