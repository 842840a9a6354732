#include "core/serial_branches.h"

#include <algorithm>
#include <string>

#include "core/units.h"

namespace trn {

namespace {

int read_joint(const ConfigTable& table, const Joints& joints) {
  std::vector<std::string> names;
  for (const Joint& joint : joints) names.push_back(joint.name);
  const std::string name = table.choice("joint", names);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

Vec3 read_direction(const ConfigTable& table) {
  const Vec3 direction = table.vec3("direction");
  if (!(direction.norm() > 1e-9)) throw table.error("direction", "a direction must not be zero");
  // Only the direction counts: [0, 0, 10] is the same axis as [0, 0, 1].
  return direction.normalized();
}

BranchAxis read_axis(const ConfigTable& table, const Joints& joints, std::vector<bool>& seen) {
  BranchAxis axis{-1, JointKind::kLinear, Vec3::UnitZ(), table.vec3("offset_mm", Vec3::Zero()), table};
  // A fixed offset, such as the way from the last axis to the spindle nose. One of the two keys without the
  // other is an axis with a key missing, and is told as such below.
  const bool tilted = table.has("tilt_deg");
  if (!table.has("joint") && !table.has("direction") && !tilted) return axis;
  if (tilted) {
    if (table.has("joint"))
      throw table.error("tilt_deg",
                        "'tilt_deg' does not go with 'joint': an axis with a joint turns by itself; give the "
                        "tilt an entry of its own");
    axis.direction = read_direction(table);
    return axis;
  }
  axis.joint = read_joint(table, joints);
  const auto index = static_cast<std::size_t>(axis.joint);
  if (seen[index]) throw table.error("joint", "this joint is already in a branch");
  seen[index] = true;
  axis.kind = joints[index].kind;
  axis.direction = read_direction(table);
  return axis;
}

/// What a clamped axis turns: all that is behind it, as a joint at that angle would.
void carry(const Mat3& R_tilt, BranchAxis& axis) {
  axis.offset_mm = R_tilt * axis.offset_mm;
  axis.direction = R_tilt * axis.direction;
}

}  // namespace

SerialBranches read_branches(const ConfigTable& section, const Joints& joints) {
  SerialBranches out;
  std::vector<bool> seen(joints.size(), false);
  for (const ConfigTable& table : section.tables_if("tool_branch")) {
    out.tool.push_back(read_axis(table, joints, seen));
    carry(out.R_MS, out.tool.back());
    if (!table.has("tilt_deg")) continue;
    const double tilt_rad = rad_from_deg(table.number("tilt_deg", Range{-180.0, 180.0}));
    out.R_MS = Eigen::AngleAxisd(tilt_rad, out.tool.back().direction).toRotationMatrix() * out.R_MS;
  }
  for (const ConfigTable& table : section.tables_if("work_branch")) {
    if (table.has("tilt_deg"))
      throw table.error("tilt_deg",
                        "'tilt_deg' is of the tool branch only; for work that lies at an angle use G68.2");
    out.work.push_back(read_axis(table, joints, seen));
  }
  return out;
}

}  // namespace trn
