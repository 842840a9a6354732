#include "app/cli/kinematics_json.h"

#include <string>
#include <utility>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/serial_branches.h"

namespace trn {

namespace {

nlohmann::json vector_json(const Vec3& v) { return {v[0], v[1], v[2]}; }

nlohmann::json branch_json(const std::vector<BranchAxis>& branch) {
  nlohmann::json out = nlohmann::json::array();
  for (const BranchAxis& axis : branch) {
    nlohmann::json one{{"joint", axis.joint}, {"offset_mm", vector_json(axis.offset_mm)}};
    if (axis.joint >= 0) {
      one["kind"] = axis.kind == JointKind::kRotary ? "rotary" : "linear";
      one["direction"] = vector_json(axis.direction);
    }
    out.push_back(std::move(one));
  }
  return out;
}

nlohmann::json serial_json(const ConfigTable& section, const Machine& machine) {
  const SerialBranches branches = read_branches(section, machine.joints);
  const Eigen::AngleAxisd turn(branches.R_MS);
  return {{"tool", branch_json(branches.tool)},
          {"work", branch_json(branches.work)},
          {"spindle_turn_rad", vector_json(turn.angle() * turn.axis())}};
}

// Six legs or four rails, with the places of their ends.
nlohmann::json platform_json(const ConfigTable& section, const char* list,
                             const std::vector<std::string>& places) {
  nlohmann::json actuators = nlohmann::json::array();
  for (const ConfigTable& one : section.tables(list)) {
    nlohmann::json actuator;
    for (const std::string& place : places) actuator[place] = vector_json(one.vec3(place));
    actuators.push_back(std::move(actuator));
  }
  return {{"carries", section.text("carries")},
          {"spindle_mm", vector_json(section.vec3("spindle_mm"))},
          {"home_mm", vector_json(section.vec3("home_mm"))},
          {"actuators", std::move(actuators)}};
}

}  // namespace

nlohmann::json kinematics_json(const Machine& machine) {
  const ConfigTable section = machine.root.table("kinematics");
  const std::string type = section.text("type");
  nlohmann::json out = type == "serial" ? serial_json(section, machine)
                       : type == "hexapod"
                           ? platform_json(section, "leg", {"base_mm", "platform_mm"})
                           : platform_json(section, "rail", {"rail_mm", "direction", "platform_mm"});
  out["type"] = type;
  return out;
}

}  // namespace trn
