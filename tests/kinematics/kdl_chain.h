#pragma once

#include <kdl/chain.hpp>
#include <kdl/jntarray.hpp>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

/// A serial machine for KDL, built from the config by a reader of its own.
struct KdlChain {
  KDL::Chain chain;        ///< table to spindle nose
  std::vector<int> joint;  ///< of the machine, by joint of the chain

  KDL::JntArray joints(const JointVec& q) const {
    KDL::JntArray out(static_cast<unsigned>(joint.size()));
    for (std::size_t i = 0; i < joint.size(); ++i) out(static_cast<unsigned>(i)) = q[joint[i]];
    return out;
  }
};

inline KDL::Vector kdl_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

inline KdlChain make_kdl_chain(const Machine& machine) {
  KdlChain out;
  const auto add_offset = [&](const Vec3& offset) {
    out.chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), KDL::Frame(kdl_of(offset))));
  };
  const auto add_tilt = [&](const ConfigTable& table) {
    if (!table.has("tilt_deg")) return;
    const KDL::Vector axis = kdl_of(table.vec3("direction").normalized());
    const KDL::Frame turned(
        KDL::Rotation::Rot2(axis, rad_from_deg(table.number("tilt_deg", Range{-180, 180}))));
    out.chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), turned));
  };
  const auto add_joint = [&](const ConfigTable& table, double side) {
    if (!table.has("joint")) return;
    int index = 0;
    while (machine.joints[static_cast<std::size_t>(index)].name != table.text("joint")) ++index;
    const bool rotary = machine.joints[static_cast<std::size_t>(index)].kind == JointKind::kRotary;
    const auto type = rotary ? KDL::Joint::RotAxis : KDL::Joint::TransAxis;
    const Vec3 axis = side * table.vec3("direction").normalized();
    out.chain.addSegment(KDL::Segment(KDL::Joint(KDL::Vector::Zero(), kdl_of(axis), type)));
    out.joint.push_back(index);
  };
  const ConfigTable section = machine.root.table("kinematics");
  const auto work = section.tables_if("work_branch");
  for (auto table = work.rbegin(); table != work.rend(); ++table) {
    add_joint(*table, -1);
    add_offset(-table->vec3("offset_mm", Vec3::Zero()));
  }
  for (const ConfigTable& table : section.tables_if("tool_branch")) {
    add_offset(table.vec3("offset_mm", Vec3::Zero()));
    add_joint(table, 1);
    add_tilt(table);
  }
  return out;
}

}  // namespace trn
