#pragma once

#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"
#include "interp/move.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "tests/interp/plan/block_clock.h"

// How long every programmed block was driven, measured on the setpoints alone.
namespace trn::test {

/// Feed it the moves of a program in order and every report of its run, then read `clock().blocks`.
class BlockTimes {
 public:
  BlockTimes(const Machine& machine, const MachineJointMap& map, const Kinematics& kinematics)
      : machine_(machine), map_(map), kinematics_(kinematics), clock_(machine.period_s) {}

  void programmed(const ProgramMove& move) { clock_.programmed(move); }

  void sample(const CycleReport& report) {
    const double worst = joints(report.q_setpoint);
    Words y;
    if (report.on_path && words_of(report, y)) clock_.sample(y, worst);
  }

  const BlockClock& clock() const { return clock_; }

 private:
  // The words that these joints stand for.
  bool words_of(const CycleReport& report, Words& y) const {
    if (map_.words_at(report.q_plan, report.context, y) != KinStatus::kOk) return false;
    if (!report.context.rtcp) return true;
    ToolPose pose;
    const bool known = tool_pose(kinematics_, report.q_plan, report.context, pose) == KinStatus::kOk;
    y.head<3>() = pose.p_B;
    return known;
  }

  // The worst ratio that the last setpoints show.
  double joints(const JointVec& q) {
    for (int k = 3; k > 0; --k) q_[k] = q_[k - 1];
    q_[0] = q;
    if (++rows_ < 4) return 0;
    const double T = machine_.period_s;
    double worst = 0;
    for (std::size_t i = 0; i < machine_.joints.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      const JointLimit& limit = machine_.joints[i].limit;
      const double d1 = q_[0][k] - q_[1][k], d2 = q_[0][k] - 2 * q_[1][k] + q_[2][k];
      const double d3 = d2 - (q_[1][k] - 2 * q_[2][k] + q_[3][k]);
      worst = std::max({worst, std::abs(d1) / T / limit.velocity, std::abs(d2) / (T * T) / limit.acceleration,
                        std::abs(d3) / (T * T * T) / limit.jerk});
    }
    return worst;
  }

  const Machine& machine_;
  const MachineJointMap& map_;
  const Kinematics& kinematics_;
  BlockClock clock_;
  JointVec q_[4];
  std::uint64_t rows_ = 0;
};

}  // namespace trn::test
