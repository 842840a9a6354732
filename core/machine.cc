#include "core/machine.h"

#include <fmt/format.h>

#include "core/units.h"

namespace trn {

namespace {

Joint read_joint(const ConfigTable& table) {
  Joint joint;
  joint.name = table.text("name");
  const bool rotary = table.choice("type", {"linear", "rotary"}) == "rotary";
  joint.kind = rotary ? JointKind::kRotary : JointKind::kLinear;
  const double unit = rotary ? kRadPerDeg : 1.0;
  const std::string u = rotary ? "deg" : "mm";
  auto& limit = joint.limit;
  limit.min = unit * table.number("min_" + u);
  limit.max = unit * table.number("max_" + u);
  limit.velocity = unit * table.number(fmt::format("velocity_{}_s", u), kPositive);
  limit.acceleration = unit * table.number(fmt::format("acceleration_{}_s2", u), kPositive);
  limit.jerk = unit * table.number(fmt::format("jerk_{}_s3", u), kPositive);
  if (limit.min >= limit.max) throw table.error("max_" + u, "the upper limit must lie above the lower limit");
  return joint;
}

}  // namespace

Machine read_machine(const ConfigTable& root) {
  const ConfigTable section = root.table("machine");
  // 10 us to 100 ms: below, no host keeps its time, and above no path is followed any more.
  Machine machine{root, section.text("name"), section.number("period_s", Range{1e-5, 0.1}), {}};
  for (const ConfigTable& table : root.tables("joint")) {
    Joint joint = read_joint(table);
    for (const Joint& other : machine.joints)
      if (other.name == joint.name)
        throw table.error("name", fmt::format("two joints are named '{}'", joint.name));
    machine.joints.push_back(joint);
  }
  if (machine.joints.empty() || machine.joints.size() > kMaxJoints)
    throw root.error("joint", fmt::format("a machine has 1 to {} joints", kMaxJoints));
  return machine;
}

}  // namespace trn
