#pragma once

#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"

namespace trn {

/// One entry of a branch of a serial machine: a fixed offset, and the joint behind it, if any. Both vectors
/// lie in the machine frame, as the machine stands with every joint at zero.
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
  Mat3 R_MS = Mat3::Identity();  ///< the spindle with every joint at zero: turned where the head is tilted
};

/// Reads [[kinematics.tool_branch]] and [[kinematics.work_branch]] of `section`. An entry with `tilt_deg` is
/// a rotary axis that is clamped at that angle: it turns the entries behind it. ConfigError for a joint that
/// the machine has not or that is in a branch already, for a direction of no length, and for a tilt of a
/// joint or of the table. A joint that is in neither branch is the caller's matter.
SerialBranches read_branches(const ConfigTable& section, const Joints& joints);

}  // namespace trn
