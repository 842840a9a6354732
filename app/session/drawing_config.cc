#include "app/session/drawing_config.h"

#include <filesystem>

#include "core/axes.h"

namespace trn {

namespace {

// Legs and rails are drawn by their ends alone.
std::vector<std::string> parts_of(const Machine& machine) {
  std::vector<std::string> parts{"base", "table", "spindle"};
  if (machine.root.table("kinematics").text("type") == "serial")
    for (const Joint& joint : machine.joints) parts.push_back(joint.name);
  return parts;
}

}  // namespace

std::vector<Drawing> read_drawings(const Machine& machine) {
  std::vector<Drawing> out;
  const std::filesystem::path folder = std::filesystem::path(machine.root.file()).parent_path();
  for (const ConfigTable& table : machine.root.tables_if("drawing"))
    out.push_back({table.choice("part", parts_of(machine)), (folder / table.text("stl")).string(), table});
  return out;
}

}  // namespace trn
