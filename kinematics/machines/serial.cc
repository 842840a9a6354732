#include "kinematics/machines/serial.h"

#include <fmt/format.h>

#include "core/axes.h"
#include "core/frames.h"
#include "core/serial_branches.h"
#include "kinematics/serial/chain.h"
#include "kinematics/serial/serial_kinematics.h"

namespace trn {

namespace {

WordOfJoint read_word(const ConfigTable& table, const Joint& joint) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const std::vector<std::string> legal =
      rotary ? std::vector<std::string>{"A", "B", "C"} : std::vector<std::string>{"X", "Y", "Z"};
  const bool named_so = std::find(legal.begin(), legal.end(), joint.name) != legal.end();
  const std::string word = named_so ? table.choice("word", legal, joint.name) : table.choice("word", legal);
  const double sense = table.number("sense", 1.0, kAnyNumber);
  if (sense != 1.0 && sense != -1.0)
    throw table.error("sense", fmt::format("sense is 1 or -1, not {:g}", sense));
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

/// The word and sense of every joint of a branch.
void read_words(const std::vector<BranchAxis>& branch, SerialConfig& config, std::vector<bool>& seen) {
  for (const BranchAxis& axis : branch) {
    if (axis.joint < 0) continue;
    config.words[axis.joint] = read_word(axis.table, config.joints[axis.joint]);
    seen[axis.joint] = true;
    check_word_free(axis.table, config, axis.joint, seen);
  }
}

SerialChain make_chain(const SerialBranches& branches) {
  SerialChain chain;
  // The chain begins at the table and goes to the base against the order of the config. There each joint acts
  // with its sign turned round and each offset comes behind its joint: (Trans(o) M(q))^-1 = M(-q) Trans(-o).
  // A table that goes to X+ carries the work away under the tool, which goes to X- over the work.
  for (auto axis = branches.work.rbegin(); axis != branches.work.rend(); ++axis) {
    if (axis->joint >= 0) chain.append_joint(axis->joint, axis->kind, -axis->direction);
    chain.append_offset(-axis->offset_mm);
  }
  for (const BranchAxis& axis : branches.tool) {
    chain.append_offset(axis.offset_mm);
    if (axis.joint >= 0) chain.append_joint(axis.joint, axis.kind, axis.direction);
  }
  chain.set_end(branches.R_MS);
  return chain;
}

/// Gauge point in the table with every joint at zero: where the machine frame lies.
Pose home_of(const SerialBranches& branches) {
  Pose X_BM;
  for (const BranchAxis& axis : branches.tool) X_BM.p += axis.offset_mm;
  for (const BranchAxis& axis : branches.work) X_BM.p -= axis.offset_mm;
  return X_BM;
}

}  // namespace

std::unique_ptr<Kinematics> make_serial(const Machine& machine, const ConfigTable& section) {
  SerialConfig config;
  config.joints = machine.joints;
  std::vector<bool> seen(machine.joints.size(), false);
  const SerialBranches branches = read_branches(section, machine.joints);
  read_words(branches.tool, config, seen);
  read_words(branches.work, config, seen);
  section.finish();  // a misspelt key explains a missing joint better than what follows
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (!seen[i])
      throw section.error(
          "", fmt::format("joint '{}' is in neither tool_branch nor work_branch", machine.joints[i].name));
  config.chain = make_chain(branches);
  config.home_X_BM = home_of(branches);
  return std::make_unique<SerialKinematics>(config);
}

}  // namespace trn
