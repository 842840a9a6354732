#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

namespace trn {

/// A shipped machine with its kinematics.
struct LoadedMachine {
  Machine machine;
  std::unique_ptr<Kinematics> kinematics;
};

/// A shipped machine's config, or one that exists only in the tests.
inline std::string config_path(const std::string& name) {
  const std::string shipped = source_dir() + "/configs/" + name + ".toml";
  return std::filesystem::exists(shipped) ? shipped : source_dir() + "/tests/data/machines/" + name + ".toml";
}

inline LoadedMachine load_machine(const std::string& name) {
  Machine machine = read_machine(load_config(config_path(name)));
  auto kinematics = make_kinematics(machine);
  return {std::move(machine), std::move(kinematics)};
}

inline nlohmann::json load_vectors(const std::string& name) {
  std::ifstream in(source_dir() + "/tests/data/vectors/" + name + ".json");
  return nlohmann::json::parse(in);
}

/// The rows of such a file, of which there is one at least. By value: a loop over a part of load_vectors()
/// would go over what is gone.
inline std::vector<nlohmann::json> vector_rows(const std::string& name) {
  auto rows = load_vectors(name).at("rows").get<std::vector<nlohmann::json>>();
  if (rows.empty()) throw std::runtime_error(name + ": no rows");
  return rows;
}

inline Vec3 vec3_of(const nlohmann::json& j) {
  return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()};
}

inline JointVec joints_of(const nlohmann::json& j) {
  JointVec q(static_cast<Eigen::Index>(j.size()));
  for (std::size_t i = 0; i < j.size(); ++i) q[static_cast<Eigen::Index>(i)] = j[i];
  return q;
}

}  // namespace trn
