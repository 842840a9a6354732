#pragma once

#include <array>
#include <vector>

#include "core/axes.h"
#include "core/differencer.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/motion.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"

namespace trn {

/// What happened in some periods in a row: worst values, and where the tip was at first.
struct RunBin {
  double t_s = 0;
  bool on_path = false;
  Vec3 p_W = Vec3::Zero();                                           ///< mm
  double speed_mm_s = 0, acceleration_mm_s2 = 0, jerk_mm_s3 = 0;     ///< of the tip's way, magnitudes
  std::array<float, kMaxJoints> velocity{}, acceleration{}, jerk{};  ///< of the joints, over their limits
  float worst = 0;                                                   ///< the greatest of these,
  int worst_joint = -1;                                              ///< and its joint
};

/// Watches a run for its pictures. Memory is bounded: when there are too many bins, neighbours are merged.
class RunRecorder final : public ReportSink {
 public:
  RunRecorder(const Machine& machine, const MachineJointMap& map) : machine_(machine), map_(map) {}

  void write(const CycleReport& report) override;

  const std::vector<RunBin>& bins() const { return bins_; }

 private:
  void joints(const JointVec& q, RunBin& bin);
  void tip(const CycleReport& report, RunBin& bin);
  void add(const RunBin& bin);

  const Machine& machine_;
  const MachineJointMap& map_;
  std::array<Differencer, kMaxJoints> q_;
  MapContext context_;
  Vec3 p_last_ = Vec3::Zero();
  std::array<double, 3> speed_{};
  int tips_ = 0;
  std::uint64_t periods_ = 0, per_bin_ = 1, in_bin_ = 0;
  std::vector<RunBin> bins_;
};

}  // namespace trn
