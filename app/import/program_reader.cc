#include "app/import/program_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "app/import/import_place.h"
#include "app/import/startup_reader.h"
#include "core/letter_case.h"
#include "interp/gcode/modal.h"

namespace trn {

namespace {

/// A remapped code: REMAP = M428 modalgroup=10 ngc=428remap
struct Remap {
  std::string code = {}, ngc = {};
  bool plain = true;  ///< nothing but modalgroup and ngc
};

Remap read_remap(const IniEntry& entry) {
  Remap out;
  std::istringstream words(entry.value);
  words >> out.code;
  out.code = upper_case(out.code);
  for (std::string word; words >> word;) {
    if (word[0] == '#' || word[0] == ';') break;
    if (word.starts_with("ngc="))
      out.ngc = word.substr(4);
    else
      out.plain = out.plain && word.starts_with("modalgroup=");
  }
  return out;
}

/// An M code without a meaning of its own, as the config takes it.
bool is_user_code(const std::string& code) {
  const std::optional<double> number =
      whole_number_text(std::string_view(code).substr(std::min<std::size_t>(1, code.size())));
  return code.starts_with('M') && number && *number >= 0 && *number < ModalTable::kMCodes &&
         *number == std::floor(*number) && ModalTable().m_group(static_cast<int>(*number)) < 0;
}

bool has_text(const std::vector<std::string>& texts, const std::string& text) {
  return std::find(texts.begin(), texts.end(), text) != texts.end();
}

void read_remaps(const IniFile& ini, bool switchable, ImportedMachine& machine) {
  for (const IniEntry* entry : ini.all("RS274NGC", "REMAP")) {
    const Remap remap = read_remap(*entry);
    if (switchable && (remap.code == "M428" || remap.code == "M429")) {
      if (has_text(machine.rtcp_on, remap.code) || has_text(machine.rtcp_off, remap.code)) continue;
      (remap.code == "M428" ? machine.rtcp_on : machine.rtcp_off).push_back(remap.code);
      machine.note(
          ImportSpot::kProgram, entry->key_place, entry->text(),
          fmt::format(
              "taken as what switches RTCP {}, as in LinuxCNC's own examples; the sub-program is not run",
              remap.code == "M428" ? "on" : "off"),
          "look whether your sub-program does more");
      continue;
    }
    const bool known = std::any_of(machine.codes.begin(), machine.codes.end(),
                                   [&](const ImportedCode& one) { return one.code == remap.code; });
    if (is_user_code(remap.code) && remap.plain && !remap.ngc.empty() && !known) {
      machine.codes.push_back({remap.code, remap.ngc});
      continue;
    }
    machine.note(ImportSpot::kProgram, entry->key_place, entry->text(),
                 "codes of one's own are M codes without a meaning that call a sub-program with P and Q as "
                 "#1 and #2; Python, other codes and argspec do not exist",
                 "[[program.m_code]] with code and call; for M6 [tool_change] confirm = \"sub-program\"");
  }
}

/// Whole paths, so that programs may lie anywhere.
void read_folder(const IniFile& ini, const IniEntry& entry, const std::string& name,
                 ImportedMachine& machine) {
  if (name.empty()) return;
  if (name[0] == '~')
    return machine.note(ImportSpot::kProgram, entry.value_place, fmt::format("{} = {}", entry.key, name),
                        "~ means another folder for each user", "write the whole path into sub_path");
  std::error_code error;
  const std::string path =
      std::filesystem::absolute(beside(folder_of(ini.path()), name), error).lexically_normal().string();
  if (!error && !has_text(machine.sub_path, path)) machine.sub_path.push_back(path);
}

void read_folders(const IniFile& ini, ImportedMachine& machine) {
  const std::pair<const char*, const char*> keys[] = {
      {"RS274NGC", "SUBROUTINE_PATH"}, {"RS274NGC", "WIZARD_ROOT"}, {"DISPLAY", "PROGRAM_PREFIX"}};
  for (const auto& [section, key] : keys) {
    const IniEntry* entry = ini.find(section, key);
    if (!entry) continue;
    std::istringstream all(ini.text(section, key));
    for (std::string one; std::getline(all, one, ':');)
      read_folder(ini, *entry, std::string(trimmed(one)), machine);
  }
}

void read_tool_change(const IniFile& ini, const HalSetup& hal, ImportedMachine& machine) {
  ImportPlace place = ini.place_of("EMCIO");
  for (const HalSignal* signal : hal.signals_of("iocontrol.0.tool-change")) {
    place = signal->place;
    const bool loops = std::any_of(signal->pins.begin(), signal->pins.end(),
                                   [](const HalWord& pin) { return pin.text == "iocontrol.0.tool-changed"; });
    if (loops) machine.tool_change = ImportedToolChange::kNobody;
  }
  const bool manual = hal.has_module("hal_manualtoolchange");
  if (manual) machine.tool_change = ImportedToolChange::kOperator;
  if (manual || machine.tool_change == ImportedToolChange::kNobody) return;
  if (!hal.signals_of("iocontrol.0.tool-change").empty())
    machine.note(
        ImportSpot::kToolChange, place, "the tool changer behind iocontrol.0.tool-change",
        "HAL logic is not carried over; the operator confirms each tool",
        "a changer of inputs and outputs is a sub-program: confirm = \"sub-program\" (docs/operator.md)");
}

/// LinuxCNC cuts S to these speeds; here a greater one is refused, so that nobody cuts with another by
/// mistake.
void read_spindle_speeds(const IniFile& ini, ImportedMachine& machine) {
  const auto note = [&](const IniEntry& entry, std::string why, std::string to_do) {
    machine.note(ImportSpot::kIo, entry.key_place, entry.text(), std::move(why), std::move(to_do));
    machine.io = true;
  };
  const auto rpm = [&](const char* key) { return std::abs(ini.number("SPINDLE_0", key).value_or(0)); };
  const double forward = rpm("MAX_FORWARD_VELOCITY"), reverse = rpm("MAX_REVERSE_VELOCITY");
  const IniEntry* of_forward = ini.find("SPINDLE_0", "MAX_FORWARD_VELOCITY");
  const IniEntry* of_reverse = ini.find("SPINDLE_0", "MAX_REVERSE_VELOCITY");
  machine.spindle_rpm_max = of_forward ? forward : reverse;
  const bool bounds = machine.spindle_rpm_max > 0;
  if (const IniEntry* entry = of_forward ? of_forward : of_reverse)
    note(*entry,
         bounds ? "LinuxCNC cuts a greater S to this speed, and here rpm_max below refuses it with its line"
                : "0 rpm is no greatest speed, and S has no bound here",
         bounds ? "nothing" : "rpm_max below, with the spindle's greatest speed");
  if (of_forward && of_reverse && forward != reverse)
    note(*of_reverse, "rpm_max below bounds both directions, by the speed of M3",
         "bound the speed of M4 in the inverter's own parameters");
  for (const char* key : {"MIN_FORWARD_VELOCITY", "MIN_REVERSE_VELOCITY"})
    if (const IniEntry* entry = ini.find("SPINDLE_0", key); entry && rpm(key) > 0)
      note(*entry, "a smaller S is not raised to this speed here", "set it in the inverter's own parameters");
  for (const char* key : {"MAX_SPINDLE_0_SPEED", "MIN_SPINDLE_0_SPEED", "MAX_SPINDLE_RPM"})
    if (const IniEntry* entry = ini.find("DISPLAY", key)) {
      ini.number("DISPLAY", key);
      note(*entry, "it bounds what buttons of LinuxCNC's window ask for, and no S of a program",
           "rpm_max in [io.spindle], if it is meant as the spindle's greatest speed");
    }
}

void read_spindle(const IniFile& ini, const HalSetup& hal, ImportedMachine& machine) {
  const bool wired = !hal.signals_of("spindle.0.").empty();
  machine.io = wired || ini.has_section("SPINDLE_0") || !hal.signals_of("motion.digital-").empty() ||
               !hal.signals_of("motion.analog-").empty() || !hal.signals_of("motion.probe-input").empty();
  machine.spindle_encoder = !hal.signals_of("spindle.0.revs").empty();
  read_spindle_speeds(ini, machine);
  for (const HalSignal* signal : hal.signals_of("spindle.0.speed-out"))
    machine.note(
        ImportSpot::kIo, signal->place,
        fmt::format("spindle output: signal {} to {}", signal->name, signal->pins.back().text),
        "what HAL wires to the spindle is not carried over; it is simulated",
        "an inverter on Modbus: [io] type = \"modbus\" with [io.spindle] speed, run (docs/config.md)");
}

void note_overrides(const IniFile& ini, ImportedMachine& machine) {
  for (const char* key : {"MAX_FEED_OVERRIDE", "MAX_RAPID_OVERRIDE", "MIN_SPINDLE_OVERRIDE",
                          "MAX_SPINDLE_OVERRIDE", "MIN_SPINDLE_0_OVERRIDE", "MAX_SPINDLE_0_OVERRIDE"})
    if (const IniEntry* entry = ini.find("DISPLAY", key)) {
      ini.number("DISPLAY", key);
      machine.note(ImportSpot::kProgram, entry->key_place, entry->text(),
                   "an override has no bounds in the config: feed goes from 0 to 200 %, rapid to 100 %, and "
                   "the limits of the "
                   "joints hold at any of them",
                   "nothing");
    }
}

void note_rtcp(const KinematicsModule& module, ImportedMachine& machine) {
  machine.note(
      ImportSpot::kProgram, module.place, fmt::format("{} at the start", module.name),
      module.identity_first
          ? "both begin with the axes' own coordinates, and M428 switches to those of the tool's tip"
          : "LinuxCNC begins in the coordinates of the tool's tip; here RTCP is off until a program switches "
            "it on",
      fmt::format("programs for the tip begin with {} or G43.4 H",
                  machine.rtcp_on.empty() ? "a word of [program] rtcp_on" : machine.rtcp_on.front()));
}

}  // namespace

void read_program(const IniFile& ini, const HalSetup& hal, const KinematicsModule& module,
                  ImportedMachine& machine) {
  const bool tips = module.name != "trivkins";
  read_remaps(ini, tips, machine);
  if (tips && machine.rtcp_on.empty()) machine.rtcp_on = {"M428"};
  if (tips && machine.rtcp_off.empty()) machine.rtcp_off = {"M429"};
  read_folders(ini, machine);
  read_startup(ini, machine);
  for (const ImportedJoint& joint : machine.joints) {
    const std::string section = "AXIS_" + joint.name;
    if (joint.rotary && ini.number(section, "WRAPPED_ROTARY").value_or(0) != 0)
      machine.wrapped.push_back(joint.name);
  }
  read_tool_change(ini, hal, machine);
  read_spindle(ini, hal, machine);
  note_overrides(ini, machine);
  if (tips) note_rtcp(module, machine);
}

}  // namespace trn
