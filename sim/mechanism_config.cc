#include "sim/mechanism_config.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "core/units.h"

namespace trn {

namespace {
constexpr double kTonnesPerKg = 1e-3;  // N over mm/s^2 is tonnes
constexpr double kLoopHz = 60;
// No axis has masses or forces beyond these.
constexpr Range kOfMachines{0, 1e9}, kInertia{1e-9, 1e9};
// Not a table as the model has it: waves, so that the two share nothing.
void read_cogging_waves(const ConfigTable& table, bool rotary, ServoMechanism::Config& out) {
  const double unit = rotary ? kRadPerDeg : 1;
  const std::string wave = rotary ? "cogging_Nm" : "cogging_N",
                    at = rotary ? "cogging_at_deg" : "cogging_at_mm";
  const std::string pitch = rotary ? "cogging_pitch_deg" : "cogging_pitch_mm";
  if (!table.has(wave)) return;
  out.cogging_pitch = unit * table.number(pitch, kPositive);
  const std::vector<double> forces = table.numbers(wave);
  const std::vector<double> places = table.has(at) ? table.numbers(at) : std::vector<double>(forces.size());
  if (forces.empty() || forces.size() > ServoMechanism::kCoggingWaves)
    throw table.error(
        wave, fmt::format("'{}' has one number for each wave, 1 to {}", wave, ServoMechanism::kCoggingWaves));
  if (places.size() != forces.size())
    throw table.error(at, fmt::format("'{}' has as many numbers as '{}'", at, wave));
  for (std::size_t i = 0; i < forces.size(); ++i) {
    if (std::abs(forces[i]) > kOfMachines.max)
      throw table.error(wave, fmt::format("'{}' has a value {:g} that is out of range: -1e9 to 1e9 is legal",
                                          wave, forces[i]));
    out.cogging[i] = forces[i];
    out.cogging_at[i] = unit * places[i];
  }
}

}  // namespace

ServoMechanism::Config read_mechanism(const Joint& joint, double period_s, const ConfigTable& table) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double unit = rotary ? kRadPerDeg : 1;
  const std::string_view force = rotary ? "Nm" : "N";
  const auto key = [&](std::string_view stem) { return fmt::format("{}_{}", stem, force); };
  ServoMechanism::Config out;
  out.period_s = period_s;
  out.position_gain_1_s = table.number("position_gain_1_s", 40.0, kPositive);
  out.inertia =
      rotary ? table.number("inertia_kg_m2", kInertia) : kTonnesPerKg * table.number("inertia_kg", kInertia);
  out.velocity_gain = 2 * kPi * table.number("velocity_loop_hz", kLoopHz, kPositive) * out.inertia;
  out.integral_time_s = table.number("integral_time_s", 0.02, kNotNegative);
  out.force_max = table.number(key("force_max"), 0.0, kOfMachines);
  out.viscous = table.number(rotary ? "viscous_Nm_s" : "viscous_N_s_mm", 0.0, kOfMachines);
  out.coulomb = table.number(key("coulomb"), 0.0, kOfMachines);
  out.gravity = table.number(key("gravity"), 0.0, Range{-1e9, 1e9});
  if (rotary) {
    out.imbalance = table.number("imbalance_Nm", 0.0, kOfMachines);
    out.imbalance_at = kRadPerDeg * table.number("imbalance_at_deg", 0.0, Range{-360, 360});
  }
  read_cogging_waves(table, rotary, out);
  out.resonance_rad_s = 2 * kPi * table.number("resonance_hz", 0.0, Range{0, 2000});
  out.resonance_damping = table.number("resonance_damping", 0.02, Range{0, 1});
  out.load_share = table.number("load_share", 0.5, Range{0.01, 0.99});
  out.backlash = unit * table.number(rotary ? "backlash_deg" : "backlash_mm", 0.0, kNotNegative);
  return out;
}

ServoMechanism::Config plain_mechanism(const Joint& joint, double period_s, double rated_force) {
  ServoMechanism::Config out;
  out.period_s = period_s;
  out.position_gain_1_s = 40;
  out.inertia = rated_force / (2 * joint.limit.acceleration);
  out.velocity_gain = 2 * kPi * kLoopHz * out.inertia;
  out.integral_time_s = 0.02;
  return out;
}

}  // namespace trn
