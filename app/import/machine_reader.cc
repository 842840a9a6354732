#include "app/import/machine_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/import/import_place.h"
#include "app/import/joint_reader.h"
#include "app/import/kinematics_module.h"
#include "app/import/kinematics_reader.h"
#include "app/import/leftover_notes.h"
#include "app/import/program_reader.h"
#include "core/letter_case.h"

namespace trn {

namespace {

/// A name of a unit, and how many mm or degrees it has.
struct UnitName {
  const char* name;
  double size;
};

constexpr UnitName kLinearUnits[] = {{"mm", 1},    {"metric", 1},  {"cm", 10},
                                     {"in", 25.4}, {"inch", 25.4}, {"imperial", 25.4}};
constexpr UnitName kAngularUnits[] = {{"degree", 1},       {"degrees", 1},         {"deg", 1},
                                      {"rad", 180 / M_PI}, {"radian", 180 / M_PI}, {"grad", 0.9},
                                      {"gon", 0.9}};

template <std::size_t n>
double read_unit(const IniFile& ini, const char* key, const UnitName (&names)[n], ImportedMachine& machine) {
  const IniEntry* entry = ini.find("TRAJ", key);
  if (!entry) {
    const bool linear = std::string_view(key) == "LINEAR_UNITS";
    machine.note(ImportSpot::kMachine, ini.place_of("TRAJ"), fmt::format("no [TRAJ]{}", key),
                 fmt::format("{} was taken", linear ? "mm" : "degree"), "look whether that is true");
    return 1;
  }
  const std::string text = lower_case(ini.text("TRAJ", key));
  for (const UnitName& unit : names)
    if (text == unit.name) return unit.size;
  // Old configurations give the number of units in a mm or degree.
  if (const std::optional<double> number = whole_number_text(text); number && *number > 0) return 1 / *number;
  std::string legal;
  for (const UnitName& unit : names) legal += (legal.empty() ? "" : ", ") + std::string(unit.name);
  throw ImportError(entry->value_place, fmt::format("{} = '{}' is no unit; one of these would be right: {}",
                                                    key, entry->value.substr(0, 40), legal));
}

std::string machine_name(const IniFile& ini) {
  std::string name = ini.text("EMC", "MACHINE");
  if (name.empty()) {
    name = ini.path().substr(folder_of(ini.path()).size());
    name = name.substr(0, name.rfind('.'));
  }
  std::string out;
  for (const char c : name) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '.';
    if (plain)
      out += c;
    else if (!out.empty() && out.back() != '_')
      out += '_';
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  return out.empty() ? "imported" : out.substr(0, 40);
}

double read_period(const IniFile& ini, ImportedMachine& machine) {
  const IniEntry* entry = ini.find("EMCMOT", "SERVO_PERIOD");
  const double period_ns = ini.number("EMCMOT", "SERVO_PERIOD").value_or(1e6);
  const double period_s = period_ns * 1e-9;
  if (!(period_s >= 1e-5 && period_s <= 0.1))
    throw ImportError(entry->value_place,
                      "SERVO_PERIOD is in ns; from 10000 to 100000000 can be, as 1000000 for 1 ms");
  if (!entry)
    machine.note(ImportSpot::kMachine, ini.place_of("EMCMOT"), "no [EMCMOT]SERVO_PERIOD", "1 ms was taken",
                 "nothing");
  return period_s;
}

}  // namespace

ImportedMachine read_linuxcnc_machine(const IniFile& ini, const HalSetup& hal) {
  ImportedMachine machine;
  machine.source = ini.path();
  const KinematicsModule module = read_kinematics_module(ini, hal);
  machine.kinematics = module.name;
  machine.name = machine_name(ini);
  machine.mm_per_unit = read_unit(ini, "LINEAR_UNITS", kLinearUnits, machine);
  machine.deg_per_unit = read_unit(ini, "ANGULAR_UNITS", kAngularUnits, machine);
  machine.period_s = read_period(ini, machine);
  read_joints(ini, module, machine);
  place_axes(module, ini, hal, machine);
  read_program(ini, hal, module, machine);
  note_leftovers(ini, hal, machine);
  return machine;
}

}  // namespace trn
