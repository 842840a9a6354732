#include "app/lab/run_recorder.h"

#include <algorithm>
#include <cmath>

#include "core/ports.h"

namespace trn {

namespace {

constexpr std::size_t kBinsMax = 6000;

void merge(const RunBin& from, RunBin& into) {
  into.on_path |= from.on_path;
  into.speed_mm_s = std::max(into.speed_mm_s, from.speed_mm_s);
  into.acceleration_mm_s2 = std::max(into.acceleration_mm_s2, from.acceleration_mm_s2);
  into.jerk_mm_s3 = std::max(into.jerk_mm_s3, from.jerk_mm_s3);
  for (std::size_t i = 0; i < kMaxJoints; ++i) {
    into.velocity[i] = std::max(into.velocity[i], from.velocity[i]);
    into.acceleration[i] = std::max(into.acceleration[i], from.acceleration[i]);
    into.jerk[i] = std::max(into.jerk[i], from.jerk[i]);
  }
  if (from.worst <= into.worst) return;
  into.worst = from.worst;
  into.worst_joint = from.worst_joint;
}

}  // namespace

void RunRecorder::write(const CycleReport& report) {
  RunBin bin;
  bin.t_s = static_cast<double>(periods_++) * machine_.period_s;
  bin.on_path = report.on_path;
  joints(report.q_setpoint, bin);
  tip(report, bin);
  add(bin);
}

void RunRecorder::joints(const JointVec& q, RunBin& bin) {
  for (std::size_t i = 0; i < machine_.joints.size(); ++i) {
    const JointLimit& limit = machine_.joints[i].limit;
    const Derivatives d = q_[i].next(q[static_cast<Eigen::Index>(i)], machine_.period_s);
    bin.velocity[i] = static_cast<float>(std::abs(d.velocity) / limit.velocity);
    bin.acceleration[i] = static_cast<float>(std::abs(d.acceleration) / limit.acceleration);
    bin.jerk[i] = static_cast<float>(std::abs(d.jerk) / limit.jerk);
    const float worst = std::max({bin.velocity[i], bin.acceleration[i], bin.jerk[i]});
    if (worst <= bin.worst) continue;
    bin.worst = worst;
    bin.worst_joint = static_cast<int>(i);
  }
}

void RunRecorder::tip(const CycleReport& report, RunBin& bin) {
  ToolPose pose;
  const bool same = report.on_path && report.context == context_;
  context_ = report.context;
  if (!same) tips_ = 0;
  if (!report.on_path || tool_pose(map_, report.q_plan, report.context, pose) != KinStatus::kOk) return;
  const double T = machine_.period_s;
  speed_[2] = speed_[1];
  speed_[1] = speed_[0];
  speed_[0] = (pose.p_W - p_last_).norm() / T;
  p_last_ = bin.p_W = pose.p_W;
  ++tips_;
  if (tips_ > 1) bin.speed_mm_s = speed_[0];
  if (tips_ > 2) bin.acceleration_mm_s2 = std::abs(speed_[0] - speed_[1]) / T;
  if (tips_ > 3) bin.jerk_mm_s3 = std::abs(speed_[0] - 2 * speed_[1] + speed_[2]) / (T * T);
}

void RunRecorder::add(const RunBin& bin) {
  if (in_bin_ > 0)
    merge(bin, bins_.back());
  else
    bins_.push_back(bin);
  in_bin_ = (in_bin_ + 1) % per_bin_;
  if (bins_.size() < kBinsMax || in_bin_ > 0) return;
  for (std::size_t i = 0; 2 * i + 1 < bins_.size(); ++i) {
    bins_[i] = bins_[2 * i];
    merge(bins_[2 * i + 1], bins_[i]);
  }
  bins_.resize(kBinsMax / 2);
  per_bin_ *= 2;
}

}  // namespace trn
