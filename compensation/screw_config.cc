#include <algorithm>
#include <cmath>

#include "compensation/screw_correction.h"
#include "compensation/screw_heat.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"

namespace trn {

namespace {

int linear_joint(const Machine& machine, const ConfigTable& table) {
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints)
    if (joint.kind == JointKind::kLinear) names.push_back(joint.name);
  const std::string name = table.choice("joint", names);
  const auto found = std::find_if(machine.joints.begin(), machine.joints.end(),
                                  [&](const Joint& j) { return j.name == name; });
  return static_cast<int>(found - machine.joints.begin());
}

// No screw is longer than these, nor rubs or is cooled more; lengths of 1e300 mm would not be numbers in the
// tick.
constexpr Range kPlaces{-1e5, 1e5}, kOfScrews{0, 1e6};

ScrewSensor read_sensor(const ConfigTable& table, double length_mm, SensorBoard& board) {
  ScrewSensor sensor;
  if (!table.has("sensor")) return sensor;
  sensor.name = table.text("sensor");
  sensor.channel = board.channel(sensor.name);
  if (sensor.channel < 0) throw table.error("sensor", "too many sensors: a machine has up to 16");
  sensor.at_mm = table.number("sensor_at_mm", length_mm / 2, Range{0, length_mm});
  sensor.reference_C = table.number("reference_C", sensor.reference_C, Range{-20, 60});
  sensor.min_C = table.number("min_C", sensor.min_C, Range{-50, 200});
  sensor.max_C = table.number("max_C", sensor.max_C, Range{sensor.min_C, 200});
  sensor.rate_max_K_s = table.number("rate_max_K_s", sensor.rate_max_K_s, kPositive);
  sensor.timeout_s = table.number("timeout_s", sensor.timeout_s, kPositive);
  sensor.hold_on_dropout = table.choice("on_dropout", {"model", "hold"}, "model") == "hold";
  return sensor;
}

ScrewHeat read_heat(const ConfigTable& table) {
  ScrewHeat heat;
  heat.diameter_mm = table.number("diameter_mm", heat.diameter_mm, Range{4, 200});
  heat.nut_friction_N = table.number("nut_friction_N", heat.nut_friction_N, kOfScrews);
  heat.bearing_friction_N = table.number("bearing_friction_N", heat.bearing_friction_N, kOfScrews);
  heat.cooling_W_m2K = table.number("cooling_W_m2K", heat.cooling_W_m2K, kOfScrews);
  return heat;
}

}  // namespace

ScrewConfig read_screw(const Machine& machine, const ConfigTable& table) {
  ScrewConfig screw;
  screw.joint = linear_joint(machine, table);
  screw.fixed_bearing_mm = table.number("fixed_bearing_mm", kPlaces);
  screw.far_bearing_mm = table.number("far_bearing_mm", kPlaces);
  const double low = std::min(screw.fixed_bearing_mm, screw.far_bearing_mm);
  const double high = std::max(screw.fixed_bearing_mm, screw.far_bearing_mm);
  const JointLimit& limit = machine.joints[static_cast<std::size_t>(screw.joint)].limit;
  // A nut beyond a bearing cannot be. Bearings on the same side of the range are most often the two swapped,
  // or given on another scale than the joint's.
  if (limit.min < low || limit.max > high)
    throw table.error("far_bearing_mm", "the joint's range must lie between the two bearings");
  const std::string mounting = table.choice("mounting", {"fixed-free", "fixed-fixed", "fixed-preload"});
  if (mounting == "fixed-fixed") screw.mounting = ScrewMounting::kFixedFixed;
  if (mounting == "fixed-preload") screw.mounting = ScrewMounting::kFixedPreload;
  screw.stretch_mm =
      screw.mounting == ScrewMounting::kFixedPreload ? table.number("stretch_mm", Range{0, 1}) : 0;
  screw.alpha_per_K = table.number("alpha_per_K", screw.alpha_per_K, Range{1e-7, 1e-4});
  screw.heat = read_heat(table);
  return screw;
}

ScrewCorrectionConfig read_screws(const Machine& machine, const ConfigTable& section, SensorBoard& board) {
  ScrewCorrectionConfig config;
  config.period_s = machine.period_s;
  config.update_s = section.number("update_s", config.update_s, Range{0.1, 60});
  config.slope_max = section.number("slope_max", config.slope_max, Range{1e-6, 0.01});
  config.rate_mm_s = section.number("rate_um_s", 1000 * config.rate_mm_s, Range{0.01, 100}) / 1000;
  for (const ConfigTable& table : section.tables("axis")) {
    const bool rotary = table.choice("encoder", {"rotary", "linear"}, "rotary") == "rotary";
    ScrewConfig screw = read_screw(machine, table);
    screw.sensor = read_sensor(table, std::abs(screw.far_bearing_mm - screw.fixed_bearing_mm), board);
    for (const ScrewConfig& other : config.screws)
      if (other.joint == screw.joint) throw table.error("joint", "this joint has its screw already");
    // The sensor's channel was taken before, so that its readings can still be logged and shown.
    if (rotary) config.screws.push_back(std::move(screw));  // a linear scale does not see the screw
  }
  return config;
}

}  // namespace trn
