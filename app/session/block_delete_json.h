#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/session/json_numbers.h"
#include "interp/gcode/program_config.h"

namespace trn {

/// As [[blocks, on], ...].
inline nlohmann::json changes_json(const std::vector<BlockDeleteChange>& changes) {
  nlohmann::json json = nlohmann::json::array();
  for (const BlockDeleteChange& change : changes) json.push_back({change.after_block, change.on});
  return json;
}

/// The way back; std::exception where it is no such thing.
inline std::vector<BlockDeleteChange> changes_from(const nlohmann::json& json) {
  std::vector<BlockDeleteChange> changes;
  for (const nlohmann::json& change : json)
    changes.push_back({whole<std::uint64_t>(change.at(0)), change.at(1).get<bool>()});
  return changes;
}

}  // namespace trn
