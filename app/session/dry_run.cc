#include "app/session/dry_run.h"

#include <fmt/format.h>

#include "app/session/program_step.h"
#include "core/ports.h"
#include "kernel/joint_map.h"

namespace trn {

namespace {
constexpr int kHalvings = 16;
}

void DryRun::move(const ProgramMove& move) {
  ProgramMove m = move;
  m.feed = FeedLimit{};
  m.feed.overrides = move.feed.overrides;
  m.duration_s = 0;
  // From where the move before has ended, in the words of this one; the first begins where the machine
  // stands.
  if (before_ && *before_ == m.context)
    m.from = end_;
  else if (before_ && words_in(*assembly_.map, stands_, m.context, m.from) != KinStatus::kOk)
    throw ProgramError(fmt::format("line {}: the dry run cannot get there", m.source.line));
  m.to = drawn_back(move.to, m.context);
  end_ = m.to;
  before_ = m.context;
  assembly_.map->map(end_, m.context, stands_);
  next_.move(m);
}

void DryRun::event(const QueueEvent& event, SourceLine source) {
  using Kind = QueueEvent::Kind;
  switch (event.kind) {
    case Kind::kSpindle:
    case Kind::kSpindleOrient:
    case Kind::kCoolant:
    case Kind::kGearStart:
    case Kind::kGearReverse:
    case Kind::kGearEnd:
      return;
    case Kind::kProbeStart:
      throw ProgramError(fmt::format(
          "line {}: a dry run has nothing to probe; 'trunnion switch dry-run off' ends it", source.line));
    default:
      return next_.event(event, source);
  }
}

bool DryRun::fits(const Words& y, const MapContext& context) const {
  JointVec q;
  if (assembly_.map->map(y, context, q) != KinStatus::kOk) return false;
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const JointLimit& limit = assembly_.plan_joints[i].limit;
    const double value = q[static_cast<Eigen::Index>(i)];
    if (value < limit.min || value > limit.max) return false;
  }
  return true;
}

// With RTCP along the tool's axis, else along the machine's Z.
Words DryRun::drawn_back(const Words& y, const MapContext& context) const {
  JointVec q;
  ToolPose pose;
  Words up = Words::Zero();
  up[kZ] = 1;
  if (context.rtcp) {
    if (assembly_.map->map(y, context, q) != KinStatus::kOk ||
        tool_pose(*assembly_.map, q, context, pose) != KinStatus::kOk)
      return y;
    up.head<3>() = pose.u_B;
  }
  if (fits(y + up_mm_ * up, context)) return y + up_mm_ * up;
  double least_mm = 0, most_mm = up_mm_;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle_mm = (least_mm + most_mm) / 2;
    (fits(y + middle_mm * up, context) ? least_mm : most_mm) = middle_mm;
  }
  return y + least_mm * up;
}

}  // namespace trn
