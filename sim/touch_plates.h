#pragma once

#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Blocks on the table that close a probe's contact when the tip is inside one.
class TouchPlates {
 public:
  /// Corners in M as it lies with every axis at zero (program coordinates without offsets), mm.
  struct Plate {
    Vec3 min_mm, max_mm;
  };

  /// `kinematics` must outlive this.
  TouchPlates(const std::vector<Plate>& plates, const Kinematics& kinematics);

  bool touches(const JointVec& q, const Vec3& tool_offset) const TRN_RT;
  bool empty() const TRN_RT { return plates_.empty(); }

 private:
  std::vector<Plate> plates_;
  const Kinematics& kinematics_;
  Pose X_MB_;  ///< table in M, at zero
};

/// The array [[plate]] of `table`; ConfigError as ConfigTable.
std::vector<TouchPlates::Plate> read_plates(const ConfigTable& table);

}  // namespace trn
