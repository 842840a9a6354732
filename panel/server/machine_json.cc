#include "panel/server/machine_json.h"

#include "core/axes.h"

namespace trn {

nlohmann::json machine_json(const Machine& machine, const std::string& version,
                            const std::string& config_path, const std::string& axes,
                            const nlohmann::json& kinematics, const std::vector<DrawnPart>& drawings,
                            const std::optional<RemoteMachine>& remote) {
  nlohmann::json parts = nlohmann::json::array();
  for (const DrawnPart& drawing : drawings) parts.push_back(drawing.part);
  nlohmann::json joints = nlohmann::json::array();
  for (const Joint& joint : machine.joints)
    joints.push_back({{"name", joint.name},
                      {"unit", joint.kind == JointKind::kRotary ? "rad" : "mm"},
                      {"min", joint.limit.min},
                      {"max", joint.limit.max},
                      {"velocity", joint.limit.velocity},
                      {"acceleration", joint.limit.acceleration},
                      {"jerk", joint.limit.jerk}});
  nlohmann::json out = {{"name", machine.name},
                        {"version", version},
                        {"config_path", config_path},
                        {"period_s", machine.period_s},
                        {"axes", axes},
                        {"kinematics", kinematics},
                        {"joints", joints},
                        {"drawings", parts}};
  if (remote) out["remote"] = {{"key", remote->key_name}, {"role", std::string(to_string(remote->role))}};
  return out;
}

}  // namespace trn
