#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/machine.h"
#include "panel/server/panel_config.h"

namespace trn {

/// The machine as pages have it: type Machine of panel/interface. `axes` as a status tells them.
nlohmann::json machine_json(const Machine& machine, const std::string& version,
                            const std::string& config_path, const std::string& axes,
                            const nlohmann::json& kinematics, const std::vector<DrawnPart>& drawings,
                            const std::optional<RemoteMachine>& remote);

}  // namespace trn
