#include "app/import/hexapod_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "app/import/import_place.h"
#include "core/frames.h"

namespace trn {

namespace {

/// A pin of the module. What the module itself has where nobody sets it is an example, not this machine.
double hexapod_pin(const KinematicsModule& module, const HalSetup& hal, const std::string& pin,
                   std::optional<double> own) {
  const std::optional<HalValue> value = hal.value_of(pin);
  if (!value && own) return *own;
  if (!value)
    throw ImportError(module.place,
                      fmt::format("nothing in the HAL files that were read sets {}; 'setp {} VALUE' would "
                                  "be right",
                                  pin, pin));
  if (value->text.empty())
    throw ImportError(value->place,
                      fmt::format("{} follows {}, which a program gives while LinuxCNC runs; 'setp {} "
                                  "VALUE' would be right",
                                  pin, value->driver, pin));
  const std::optional<double> number = whole_number_text(value->text);
  if (!number)
    throw ImportError(value->place, fmt::format("'{}' for {} is no number; one as 12.5 would be right",
                                                value->text.substr(0, 40), pin));
  return *number;
}

Vec3 hexapod_point(const KinematicsModule& module, const HalSetup& hal, const std::string& prefix) {
  return {hexapod_pin(module, hal, prefix + ".x", {}), hexapod_pin(module, hal, prefix + ".y", {}),
          hexapod_pin(module, hal, prefix + ".z", 0)};
}

double leg_at(const ImportedHexapod& hexapod, int i, double z) {
  return (Vec3(0, 0, z) + hexapod.platform_mm[i] - hexapod.base_mm[i]).norm();
}

/// How far the legs are, upright at the height z, from where they stand after homing: a sum of squares.
double miss_at(const ImportedMachine& machine, const ImportedHexapod& hexapod, double z) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) {
    const ImportedJoint& leg = machine.joints[i];
    const double length = leg_at(hexapod, i, z);
    sum += (length - leg.home) * (length - leg.home);
    if (length < leg.min || length > leg.max) sum += 1e6 + (length - leg.home) * (length - leg.home);
  }
  return sum;
}

/// The height of the platform at home: [TRAJ]HOME says it, or the legs' lengths after homing do.
double home_height(const IniFile& ini, const ImportedMachine& machine, const ImportedHexapod& hexapod) {
  double longest = 0;
  for (const ImportedJoint& leg : machine.joints) longest = std::max(longest, std::abs(leg.home));
  for (int i = 0; i < 6; ++i) longest = std::max(longest, leg_at(hexapod, i, 0));
  double best = 0;
  double sign = 1;
  if (const IniEntry* home = ini.find("TRAJ", "HOME")) {
    std::istringstream words(home->value);
    double x = 0, y = 0, z = 0;
    if (words >> x >> y >> z && z < 0) sign = -1;
  }
  constexpr int kSteps = 20000;
  for (int i = 0; i <= kSteps; ++i) {
    const double z = sign * 2 * longest * i / kSteps;
    if (miss_at(machine, hexapod, z) < miss_at(machine, hexapod, best)) best = z;
  }
  return best;
}

void note_what_differs(const KinematicsModule& module, const HalSetup& hal, ImportedMachine& machine) {
  machine.note(
      ImportSpot::kKinematics, module.place, "words A, B and C of genhexkins",
      "there the platform turns by Rz(C) Ry(B) Rx(A); here by Rx(A) Ry(B), and C has no meaning, since it "
      "turns about the tool. A alone and B alone are the same",
      "programs that tilt about A and B at once need a post-processor for A and B as here");
  for (const auto& [pin, value] : hal.parameters()) {
    const bool lead = pin == "genhexkins.screw-lead" && whole_number_text(value.text).value_or(0) != 0;
    if (lead || pin.starts_with("genhexkins.base-n.") || pin.starts_with("genhexkins.platform-n."))
      machine.note(ImportSpot::kKinematics, value.place, fmt::format("{} = {}", pin, value.text),
                   "the turn of a leg's screw as the platform tilts is not corrected here",
                   "nothing if the drives see the length itself");
    if (pin.starts_with("genhexkins.convergence") || pin.starts_with("genhexkins.limit-iter") ||
        pin == "genhexkins.max-error")
      machine.note(ImportSpot::kKinematics, value.place, fmt::format("{} = {}", pin, value.text),
                   "the search for the platform's pose has bounds of its own", "nothing");
  }
}

}  // namespace

void place_hexapod(const KinematicsModule& module, const IniFile& ini, const HalSetup& hal,
                   ImportedMachine& machine) {
  ImportedHexapod hexapod;
  const double spindle = machine.mm_per_unit * hexapod_pin(module, hal, "genhexkins.spindle-offset", 0);
  for (int i = 0; i < 6; ++i) {
    hexapod.base_mm[i] =
        machine.mm_per_unit * hexapod_point(module, hal, fmt::format("genhexkins.base.{}", i));
    hexapod.platform_mm[i] =
        machine.mm_per_unit * hexapod_point(module, hal, fmt::format("genhexkins.platform.{}", i));
    // LinuxCNC's position is the platform's origin, upright; here it is the gauge point, which is lower.
    hexapod.base_mm[i].z() += spindle;
  }
  hexapod.spindle_mm = Vec3(0, 0, -spindle);
  const double z = home_height(ini, machine, hexapod);
  hexapod.home_mm = Vec3(0, 0, z);
  for (int i = 0; i < 6; ++i) {
    const ImportedJoint& leg = machine.joints[i];
    hexapod.home_legs_mm[i] = leg_at(hexapod, i, z);
    if (hexapod.home_legs_mm[i] < leg.min || hexapod.home_legs_mm[i] > leg.max)
      throw ImportRefusal(module.place,
                          fmt::format("upright above the middle of its base, this platform has no height at "
                                      "which every leg is within its limits: [JOINT_{}] would be {:.6g} mm",
                                      i, hexapod.home_legs_mm[i]));
  }
  note_what_differs(module, hal, machine);
  machine.hexapod = hexapod;
}

}  // namespace trn
