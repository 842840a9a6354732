#include "core/machine.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/units.h"

namespace trn {

namespace {

constexpr double kEndless_deg = 3.6e7;  // 100,000 turns either way: an endless joint's range

bool is_of_name(char c) {
  // Beyond ASCII TOML lets nothing but UTF-8 pass: letters of other languages.
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
         static_cast<unsigned char>(c) >= 0x80;
}

// A joint's name heads a column of traces, and is a word in lists, signals and on command lines.
std::string read_joint_name(const ConfigTable& table) {
  constexpr const char* kLegal = "letters, digits, '_' and '-' are legal, as in \"X\" or \"leg1\"";
  const std::string name = table.text("name");
  if (name.empty() || !std::all_of(name.begin(), name.end(), is_of_name))
    throw table.error("name", fmt::format("\"{}\" cannot be the name of a joint; {}", name, kLegal));
  for (const char* column : {"t_s", "p_x", "p_y", "p_z", "u_i", "u_j", "u_k", "line", "load_known", "piece"})
    if (name == column)
      throw table.error("name",
                        fmt::format("'{}' is a column of every trace already, so no joint can have this "
                                    "name; {}",
                                    name, kLegal));
  return name;
}

Joint read_joint(const ConfigTable& table) {
  Joint joint;
  joint.name = read_joint_name(table);
  const bool rotary = table.choice("type", {"linear", "rotary"}) == "rotary";
  joint.kind = rotary ? JointKind::kRotary : JointKind::kLinear;
  const double unit = rotary ? kRadPerDeg : 1.0;
  const std::string u = rotary ? "deg" : "mm";
  auto& limit = joint.limit;
  joint.endless = table.boolean("endless", false);
  if (joint.endless && !rotary) throw table.error("endless", "only a rotary joint turns without an end");
  if (joint.endless && (table.has("min_deg") || table.has("max_deg")))
    throw table.error("endless", "a joint that turns without an end has no min_deg and max_deg");
  limit.min = joint.endless ? -unit * kEndless_deg : unit * table.number("min_" + u);
  limit.max = joint.endless ? unit * kEndless_deg : unit * table.number("max_" + u);
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
