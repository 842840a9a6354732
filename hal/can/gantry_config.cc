#include "hal/can/gantry_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "core/axes.h"
#include "core/units.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/gantry.h"

namespace trn {

namespace {

int joint_index(const Machine& machine, const ConfigTable& table) {
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  const std::string name = table.choice("joint", names);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

Gantry::Config read_gantry(const Machine& machine, int index, const ConfigTable& table) {
  const Joint& joint = machine.joints[static_cast<std::size_t>(index)];
  const bool rotary = joint.kind == JointKind::kRotary;
  Gantry::Config out;
  out.joint = index;
  out.name = joint.name;
  out.unit = rotary ? kRadPerDeg : 1;
  out.unit_name = rotary ? "deg" : "mm";
  const auto key = [&](std::string_view stem, std::string_view rest = "") {
    return fmt::format("{}_{}{}", stem, out.unit_name, rest);
  };
  out.apart_max = out.unit * table.number(key("apart"), kPositive);
  out.apart_homing_max =
      out.unit * table.number(key("apart_homing"), 5 * out.apart_max / out.unit, kPositive);
  const double slow = out.unit * table.number(key("squaring_speed", "_s"), rotary ? 1.0 : 2.0, kPositive);
  out.squaring = {std::min(slow, joint.limit.velocity), 0.5 * joint.limit.acceleration, machine.period_s};
  return out;
}

std::vector<CanNodeConfig*> motors_of(const std::vector<CanNodeConfig*>& nodes, int joint) {
  std::vector<CanNodeConfig*> out;
  for (CanNodeConfig* node : nodes)
    if (node->link.joint == joint) out.push_back(node);
  return out;
}

// Not a number is the same as not a number: neither has a place to go to.
bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

void check_alike(const ConfigTable& table, const CanNodeConfig& first, const CanNodeConfig& other) {
  const auto differ = [&](std::string_view what) {
    throw table.error("joint", fmt::format("the motors of a gantry must have the same {}: {} and {}", what,
                                           first.link.name, other.link.name));
  };
  if (first.link.home_group != other.link.home_group) differ("home_group");
  if (first.link.axis.absolute != other.link.axis.absolute) differ("'absolute'");
  if (first.link.axis.mode != other.link.axis.mode) differ("mode");
  if (!same(first.link.axis.home_final, other.link.axis.home_final)) differ("home_final");
}

}  // namespace

std::vector<int> read_gantry_joints(const Machine& machine, const ConfigTable& drives) {
  std::vector<int> out;
  for (const ConfigTable& table : drives.tables_if("gantry")) {
    const int joint = joint_index(machine, table);
    if (std::find(out.begin(), out.end(), joint) != out.end())
      throw table.error("joint", "this joint has a [[drives.gantry]] already");
    out.push_back(joint);
  }
  return out;
}

std::vector<Gantry::Config> read_gantries(const Machine& machine, const ConfigTable& drives,
                                          const std::vector<CanNodeConfig*>& nodes) {
  std::vector<Gantry::Config> out;
  for (const ConfigTable& table : drives.tables_if("gantry")) {
    Gantry::Config gantry = read_gantry(machine, joint_index(machine, table), table);
    const std::vector<CanNodeConfig*> motors = motors_of(nodes, gantry.joint);
    gantry.motors = static_cast<int>(motors.size());
    if (gantry.motors < 2 || gantry.motors > Gantry::kMotorsMax)
      throw table.error(
          "joint",
          fmt::format("a gantry has 2 to {} motors; there {} [[drives.node]] of joint "
                      "{}",
                      Gantry::kMotorsMax, gantry.motors == 1 ? "is 1" : fmt::format("are {}", gantry.motors),
                      gantry.name));
    for (const CanNodeConfig* motor : motors) check_alike(table, *motors[0], *motor);
    // The move behind homing is the gantry's: its motors go there together, once it is square.
    const Cia402Axis::Config& axis = motors[0]->link.axis;
    gantry.home_final = axis.home_final;
    gantry.final = {axis.final_speed, axis.final_acceleration, machine.period_s};
    gantry.step_max = std::numeric_limits<double>::infinity();
    for (CanNodeConfig* motor : motors) {
      motor->link.gantry = true;
      motor->link.axis.home_final = std::numeric_limits<double>::quiet_NaN();
      gantry.step_max = std::min(gantry.step_max, motor->link.axis.step_max);
      gantry.near = std::max(gantry.near, 10 / std::abs(motor->link.axis.counts_per_unit));
    }
    out.push_back(gantry);
  }
  return out;
}

}  // namespace trn
