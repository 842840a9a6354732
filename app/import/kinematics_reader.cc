#include "app/import/kinematics_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/import/hexapod_reader.h"
#include "core/frames.h"
#include "core/letter_case.h"

namespace trn {

namespace {

constexpr std::string_view kAxisLetters = "XYZABCUVW";

/// A module that there is no counterpart for, and why.
struct OtherModule {
  const char* name;
  const char* reason;
};

constexpr OtherModule kOtherModules[] = {
    {"maxkins", "a machine whose B head and C table are described by its source"},
    {"xyzab_tdr_kins", "a table with A and B"},
    {"millturn", "a mill that becomes a lathe by a switch"},
    {"rotatekins", "axes X and Y that are turned against the motors"},
    {"corexykins", "belts that move X and Y by two motors together"},
    {"scarakins", "an arm of the SCARA kind"},
    {"pumakins", "an arm of six turning joints"},
    {"genserkins", "an arm of turning joints by Denavit and Hartenberg"},
    {"scorbot-kins", "an arm of turning joints"},
    {"lineardeltakins", "a delta with sliders"},
    {"rotarydeltakins", "a delta with turning arms"},
    {"tripodkins", "a platform on three legs"},
    {"pentakins", "a platform on five legs"},
    {"rosekins", "a rose engine with a turning transverse axis"},
    {"userkins", "kinematics of the user's own source"},
};

constexpr const char* kChainHint =
    "a machine whose axes follow each other can be described by hand: [kinematics] type = \"serial\" "
    "(docs/new_machine.md)";

[[noreturn]] void refuse(const std::string& name, const ImportPlace& place) {
  for (const OtherModule& other : kOtherModules)
    if (name == other.name)
      throw ImportRefusal(place, fmt::format("kinematics '{}' ({}) has no counterpart here; {}", name,
                                             other.reason, kChainHint));
  throw ImportRefusal(place, fmt::format("kinematics '{}' is not known; trivkins, xyzac-trt-kins, "
                                         "xyzbc-trt-kins, 5axiskins and genhexkins are carried over; {}",
                                         name.substr(0, 40), kChainHint));
}

std::string default_letters(const std::string& name) {
  if (name == "trivkins") return std::string(kAxisLetters);
  if (name == "xyzac-trt-kins") return "XYZAC";
  if (name == "xyzbc-trt-kins") return "XYZBC";
  if (name == "5axiskins") return "XYZBCW";
  return "";
}

std::string upper_letters(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (!std::isspace(static_cast<unsigned char>(c))) out += upper_case(c);
  return out;
}

void check_letters(const KinematicsModule& module, bool written) {
  for (const char c : module.letters)
    if (kAxisLetters.find(c) == std::string_view::npos)
      throw ImportError(module.place,
                        fmt::format("'{}' in coordinates= is no axis; X Y Z A B C U V W are", c));
  if (module.letters.empty() && written)
    throw ImportError(module.place, "coordinates= needs letters, as in coordinates=XYZ");
  for (const char c : default_letters(module.name).substr(0, module.name == "trivkins" ? 0 : 5))
    if (module.letters.find(c) == std::string::npos)
      throw ImportError(module.place,
                        fmt::format("{} needs the axes {}; {} is missing in coordinates={}", module.name,
                                    default_letters(module.name).substr(0, 5), c, module.letters));
}

/// The modules that turn about two axes take a third one along, which nothing here could turn.
void refuse_more_letters(const KinematicsModule& module) {
  if (module.name == "trivkins" || module.name == "genhexkins") return;
  const std::string own = default_letters(module.name);
  for (const char c : module.letters)
    if (std::string_view("ABC").find(c) != std::string_view::npos && own.find(c) == std::string::npos)
      throw ImportRefusal(module.place,
                          fmt::format("axis {} beside those of {} ({}) has no counterpart here; {}", c,
                                      module.name, own.substr(0, 5), kChainHint));
}

/// Words of the line that names the module: from the INI, or else from `loadrt`.
std::vector<HalWord> module_words(const IniFile& ini, const HalSetup& hal) {
  std::vector<HalWord> words;
  if (const IniEntry* entry = ini.find("KINS", "KINEMATICS")) {
    std::size_t at = 0;
    while (at < entry->value.size()) {
      const std::size_t end = std::min(entry->value.find_first_of(" \t", at), entry->value.size());
      ImportPlace place = entry->value_place;
      place.column += static_cast<int>(at);
      if (end > at) words.push_back({entry->value.substr(at, end - at), place});
      at = end + 1;
    }
  }
  if (!words.empty()) return words;
  for (const HalModule& module : hal.modules())
    if (module.realtime && module.name.ends_with("kins")) {
      words.push_back({module.name, module.place});
      words.insert(words.end(), module.arguments.begin(), module.arguments.end());
      return words;
    }
  return words;
}

/// A pin of a module in the INI's units; `fallback` where nobody sets it.
double pin_number(const HalSetup& hal, const std::string& pin, double fallback, ImportedMachine& machine) {
  const std::optional<HalValue> value = hal.value_of(pin);
  if (!value) return fallback;
  if (value->text.empty()) {
    machine.note(ImportSpot::kKinematics, value->place, fmt::format("{} follows {}", pin, value->driver),
                 fmt::format("a program gives it while LinuxCNC runs; {} is taken for it", fallback),
                 "put the true value into the offset_mm below");
    return fallback;
  }
  const std::optional<double> number = whole_number_text(value->text);
  if (!number)
    throw ImportError(value->place, fmt::format("'{}' for {} is no number; one as 12.5 would be right",
                                                value->text.substr(0, 40), pin));
  return *number;
}

Vec3 pins_vec3(const HalSetup& hal, const std::string& prefix, const std::string& suffix,
               ImportedMachine& machine) {
  return Vec3(pin_number(hal, prefix + "x" + suffix, 0, machine),
              pin_number(hal, prefix + "y" + suffix, 0, machine),
              pin_number(hal, prefix + "z" + suffix, 0, machine)) *
         machine.mm_per_unit;
}

bool has_joint(const ImportedMachine& machine, const std::string& name) {
  return std::any_of(machine.joints.begin(), machine.joints.end(),
                     [&](const ImportedJoint& joint) { return joint.name == name; });
}

Vec3 axis_of(char letter) {
  const std::string_view order = kAxisLetters.substr(0, 6);
  return Vec3::Unit(static_cast<int>(order.find(letter) % 3));
}

void place_linear(ImportedMachine& machine) {
  for (const char letter : {'X', 'Y', 'Z'})
    if (const std::string name(1, letter); has_joint(machine, name))
      machine.tool_branch.push_back({name, axis_of(letter)});
}

void place_trivial(ImportedMachine& machine, const ImportPlace& place) {
  place_linear(machine);
  std::string rotary;
  for (const char letter : {'A', 'B', 'C'})
    if (const std::string name(1, letter); has_joint(machine, name)) {
      machine.work_branch.push_back({name, axis_of(letter)});
      rotary += rotary.empty() ? name : ", " + name;
    }
  if (rotary.empty()) return;
  machine.note(
      ImportSpot::kKinematics, place, fmt::format("where the rotary axes {} lie", rotary),
      "trivkins does not know it; they are taken to turn the table, right-handed about machine zero. With "
      "RTCP off, as in LinuxCNC, this changes no motion",
      "before RTCP (G43.4) is used, put the true branches, offset_mm and directions here and look with "
      "'trunnion kin'");
}

void warn_of_tool_pin(const HalSetup& hal, const std::string& pin, ImportedMachine& machine) {
  const std::optional<HalValue> value = hal.value_of(pin);
  if (!value || value->text.empty() || whole_number_text(value->text).value_or(0) == 0) return;
  machine.note(ImportSpot::kKinematics, value->place, fmt::format("{} = {}", pin, value->text),
               "a tool length that is always there: here it comes from the tool table, with G43 or G43.4",
               "add it to the lengths in the tool table, or to the last offset_mm of the tool branch");
}

/// A tilting rotary table: P = r + Rz(-C) (d + R(-tilt) (J - r - d)) in LinuxCNC's words, with r the rotation
/// point and d the way from it to the tilting axis. (Manual of the module, and measured on it.)
void place_tilting_table(const KinematicsModule& module, const HalSetup& hal, ImportedMachine& machine) {
  const std::string prefix = module.name + ".";
  const char tilt = module.name == "xyzac-trt-kins" ? 'A' : 'B';
  const Vec3 point = pins_vec3(hal, prefix, "-rot-point", machine);
  Vec3 offset = pins_vec3(hal, prefix, "-offset", machine);
  // Along its own axis a shift of the tilting axis changes nothing, and the module has no such term.
  offset[tilt == 'A' ? 0 : 1] = 0;
  const std::optional<HalValue> directions = hal.value_of(prefix + "conventional-directions");
  const bool conventional = directions && (directions->text == "1" || lower_case(directions->text) == "true");
  const double turn = conventional ? -1 : 1;
  place_linear(machine);
  machine.work_branch.push_back({std::string(1, tilt), turn * axis_of(tilt), point + offset});
  machine.work_branch.push_back({"C", Vec3(0, 0, turn), -offset});
  warn_of_tool_pin(hal, prefix + "tool-offset", machine);
}

/// A bridge mill: tip = J + (0, 0, L) + L (sin B cos C, sin B sin C, -cos B) with the pivot length L, which
/// the tool (LinuxCNC's W) makes longer. (Manual of the module, and measured on it.)
void place_bridge_head(const KinematicsModule& module, const HalSetup& hal, ImportedMachine& machine) {
  constexpr double kModulesOwn = 250;
  if (!hal.value_of("5axiskins.pivot-length"))
    machine.note(ImportSpot::kKinematics, module.place, "5axiskins.pivot-length",
                 fmt::format("nothing in the HAL files that were read sets it; the module's own {} is taken",
                             kModulesOwn),
                 "put the true length into both offset_mm below");
  const double length = pin_number(hal, "5axiskins.pivot-length", kModulesOwn, machine) * machine.mm_per_unit;
  place_linear(machine);
  machine.tool_branch.push_back({"C", Vec3(0, 0, 1), Vec3(0, 0, length)});
  machine.tool_branch.push_back({"B", Vec3(0, -1, 0)});
  machine.tool_branch.push_back({"", Vec3::Zero(), Vec3(0, 0, -length)});
}

}  // namespace

KinematicsModule read_kinematics_module(const IniFile& ini, const HalSetup& hal) {
  const std::vector<HalWord> words = module_words(ini, hal);
  if (words.empty())
    throw ImportError(ini.place_of("KINS"),
                      "no kinematics: [KINS] needs KINEMATICS = trivkins coordinates=XYZ, or another module");
  KinematicsModule module;
  module.name = words[0].text;
  module.place = words[0].place;
  if (module.name != "genhexkins" && default_letters(module.name).empty()) refuse(module.name, module.place);
  module.letters = default_letters(module.name);
  bool written = false;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const std::string word = lower_case(words[i].text);
    if (word.starts_with("coordinates=") && module.name != "genhexkins") {
      module.letters = upper_letters(words[i].text.substr(std::string_view("coordinates=").size()));
      module.place = words[i].place;
      written = true;
    }
    module.identity_first = module.identity_first || word == "sparm=identityfirst";
  }
  check_letters(module, written);
  refuse_more_letters(module);
  return module;
}

void place_axes(const KinematicsModule& module, const IniFile& ini, const HalSetup& hal,
                ImportedMachine& machine) {
  if (module.name == "trivkins") return place_trivial(machine, module.place);
  if (module.name == "genhexkins") return place_hexapod(module, ini, hal, machine);
  if (module.name == "5axiskins") return place_bridge_head(module, hal, machine);
  place_tilting_table(module, hal, machine);
}

}  // namespace trn
