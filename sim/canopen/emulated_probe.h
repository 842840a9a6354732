#pragma once

#include <memory>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/canopen/emulated_node.h"
#include "sim/touch_table.h"

namespace trn {

/// A touch probe whose signal goes to the fast inputs of all emulated drives: it meets the shapes of
/// [drives.emulation], and every drive is told where it stood at that moment between two periods.
class EmulatedProbe {
 public:
  /// `drives`: section [drives]; [drives.emulation] may have shapes and the probe's length. ConfigError as
  /// ConfigTable.
  EmulatedProbe(const Machine& machine, const ConfigTable& drives);

  /// `node` must outlive this.
  void wire(EmulatedNode& node, int joint) {
    nodes_.push_back({&node, joint, -node.drive().joint().absolute_offset()});
  }
  /// The drives have moved.
  void step() TRN_RT;

 private:
  JointVec where() const TRN_RT;
  double share_at_change(const JointVec& q) const TRN_RT;

  std::unique_ptr<Kinematics> kinematics_;
  TouchTable table_;
  Vec3 tool_offset_ = Vec3::Zero();
  struct Wire {
    EmulatedNode* node;
    int joint;
    double offset;  ///< where its encoder counts zero, mm or rad
  };
  std::vector<Wire> nodes_;
  JointVec q_before_;
  bool contact_ = false;
};

}  // namespace trn
