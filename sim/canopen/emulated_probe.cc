#include "sim/canopen/emulated_probe.h"

#include "kinematics/factory.h"

namespace trn {

namespace {

TouchTable::Config table_of(const Machine& machine, const ConfigTable& drives) {
  const auto emulation = drives.table_if("emulation");
  return emulation ? read_touch_table(machine, *emulation) : TouchTable::Config{};
}

double length_of(const ConfigTable& drives) {
  const auto emulation = drives.table_if("emulation");
  return emulation ? emulation->number("probe_length_mm", 0.0, kNotNegative) : 0;
}

}  // namespace

EmulatedProbe::EmulatedProbe(const Machine& machine, const ConfigTable& drives)
    : kinematics_(make_kinematics(machine)),
      table_(table_of(machine, drives), *kinematics_),
      tool_offset_(0, 0, length_of(drives)),
      q_before_(JointVec::Zero(static_cast<Eigen::Index>(machine.joints.size()))) {}

JointVec EmulatedProbe::where() const TRN_RT {
  JointVec q = q_before_;
  for (const Wire& wire : nodes_) q[wire.joint] = wire.node->drive().joint().measured() + wire.offset;
  return q;
}

// Halved to a millionth of a millionth of the period's way.
double EmulatedProbe::share_at_change(const JointVec& q) const TRN_RT {
  double low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    const JointVec there = q_before_ + middle * (q - q_before_);
    (table_.touches(there, tool_offset_) == contact_ ? low : high) = middle;
  }
  return high;
}

void EmulatedProbe::step() TRN_RT {
  if (table_.empty()) return;
  const JointVec q = where();
  if (table_.touches(q, tool_offset_) != contact_) {
    // All drives latch the position of the same moment, each its own: together they are the place where the
    // tip touched.
    const double share = share_at_change(q);
    contact_ = !contact_;
    for (const Wire& wire : nodes_) {
      const double before = q_before_[wire.joint], there = before + share * (q[wire.joint] - before);
      wire.node->drive().touch(contact_, there - wire.offset);
    }
  }
  q_before_ = q;
}

}  // namespace trn
