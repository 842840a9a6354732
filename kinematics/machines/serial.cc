#include "kinematics/machines/serial.h"

#include <fmt/format.h>

#include "kinematics/serial/serial_kinematics.h"

namespace trn {

namespace {

/// One entry of a branch as the config has it.
struct BranchAxis {
  int joint = -1;  ///< -1: a fixed offset
  Vec3 direction = Vec3::UnitZ();
  Vec3 offset_mm = Vec3::Zero();
};

int find_joint(const ConfigTable& table, const Joints& joints) {
  std::vector<std::string> names;
  for (const Joint& joint : joints) names.push_back(joint.name);
  const std::string name = table.choice("joint", names);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

Vec3 read_direction(const ConfigTable& table) {
  const Vec3 direction = table.vec3("direction");
  if (!(direction.norm() > 1e-9)) throw table.error("direction", "a direction must not be zero");
  return direction.normalized();
}

WordOfJoint read_word(const ConfigTable& table, const Joint& joint) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const std::vector<std::string> legal =
      rotary ? std::vector<std::string>{"A", "B", "C"} : std::vector<std::string>{"X", "Y", "Z"};
  const bool named_so = std::find(legal.begin(), legal.end(), joint.name) != legal.end();
  const std::string word = named_so ? table.choice("word", legal, joint.name) : table.choice("word", legal);
  const double sense = table.number("sense", 1.0, Range{-1.0, 1.0});
  if (sense != 1.0 && sense != -1.0) throw table.error("sense", "sense is 1 or -1");
  return {static_cast<int>(std::string_view(kWordLetters).find(word)), sense};
}

void check_word_free(const ConfigTable& table, const SerialConfig& config, int joint,
                     const std::vector<bool>& seen) {
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] && static_cast<int>(i) != joint && config.words[i].word == config.words[joint].word)
      throw table.error(table.has("word") ? "word" : "joint",
                        fmt::format("joints '{}' and '{}' both obey word {}", config.joints[i].name,
                                    config.joints[joint].name, kWordLetters[config.words[i].word]));
}

BranchAxis read_axis(const ConfigTable& table, SerialConfig& config, std::vector<bool>& seen) {
  BranchAxis axis;
  axis.offset_mm = table.vec3("offset_mm", Vec3::Zero());
  if (!table.has("joint") && !table.has("direction")) return axis;
  axis.joint = find_joint(table, config.joints);
  if (seen[axis.joint]) throw table.error("joint", "this joint is already in a branch");
  axis.direction = read_direction(table);
  config.words[axis.joint] = read_word(table, config.joints[axis.joint]);
  seen[axis.joint] = true;
  check_word_free(table, config, axis.joint, seen);
  return axis;
}

std::vector<BranchAxis> read_branch(const ConfigTable& section, const char* key, SerialConfig& config,
                                    std::vector<bool>& seen) {
  std::vector<BranchAxis> branch;
  for (const ConfigTable& table : section.tables_if(key)) branch.push_back(read_axis(table, config, seen));
  return branch;
}

SerialChain make_chain(const std::vector<BranchAxis>& tool, const std::vector<BranchAxis>& work,
                       const Joints& joints) {
  SerialChain chain;
  for (auto axis = work.rbegin(); axis != work.rend(); ++axis) {
    if (axis->joint >= 0) chain.append_joint(axis->joint, joints[axis->joint].kind, -axis->direction);
    chain.append_offset(-axis->offset_mm);
  }
  for (const BranchAxis& axis : tool) {
    chain.append_offset(axis.offset_mm);
    if (axis.joint >= 0) chain.append_joint(axis.joint, joints[axis.joint].kind, axis.direction);
  }
  return chain;
}

/// Gauge point in the table with every joint at zero: where the machine frame lies.
Pose home_of(const std::vector<BranchAxis>& tool, const std::vector<BranchAxis>& work) {
  Pose X_BM;
  for (const BranchAxis& axis : tool) X_BM.p += axis.offset_mm;
  for (const BranchAxis& axis : work) X_BM.p -= axis.offset_mm;
  return X_BM;
}

}  // namespace

std::unique_ptr<Kinematics> make_serial(const Machine& machine, const ConfigTable& section) {
  SerialConfig config;
  config.joints = machine.joints;
  std::vector<bool> seen(machine.joints.size(), false);
  const auto tool = read_branch(section, "tool_branch", config, seen);
  const auto work = read_branch(section, "work_branch", config, seen);
  section.finish();  // a misspelt key explains a missing joint better than what follows
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (!seen[i])
      throw section.error(
          "", fmt::format("joint '{}' is in neither tool_branch nor work_branch", machine.joints[i].name));
  config.chain = make_chain(tool, work, machine.joints);
  config.home_X_BM = home_of(tool, work);
  return std::make_unique<SerialKinematics>(config);
}

}  // namespace trn
