#pragma once

#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"

namespace trn {

/// One entry of a branch of a serial machine: a fixed offset, and the joint behind it, if any.
struct BranchAxis {
  int joint = -1;  ///< -1: a fixed offset only
  JointKind kind = JointKind::kLinear;
  Vec3 direction = Vec3::UnitZ();  ///< unit
  Vec3 offset_mm = Vec3::Zero();
  ConfigTable table;  ///< for what only one reader knows
};

/// A serial machine as its config has it, both branches from the machine base outwards.
struct SerialBranches {
  std::vector<BranchAxis> tool, work;
};

/// Reads [[kinematics.tool_branch]] and [[kinematics.work_branch]] of `section`. ConfigError for a joint that
/// the machine has not or that is in a branch already, and for a direction of no length. A joint that is in
/// neither branch is the caller's matter.
SerialBranches read_branches(const ConfigTable& section, const Joints& joints);

}  // namespace trn
