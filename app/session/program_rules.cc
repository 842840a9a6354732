#include "app/session/program_rules.h"

#include <fmt/format.h>

#include <cmath>

#include "core/axes.h"
#include "core/ports.h"

namespace trn {

std::string ProgramRules::refusal_of(const ProgramMove& move) const {
  const double most_mm = assembly_.planner.tolerance_mm_max;
  if (move.mode == PathMode::kContinuous && move.tolerance_mm > most_mm)
    return fmt::format(
        "the path tolerance of {:g} mm is larger than the machine's tolerance_mm_max of {:g} mm; give G64 a "
        "smaller P",
        move.tolerance_mm, most_mm);
  return geared_ ? thread_refusal(move) : "";
}

void ProgramRules::hear(const QueueEvent& event) {
  if (event.kind == QueueEvent::Kind::kGearStart) geared_ = true;
  if (event.kind == QueueEvent::Kind::kGearEnd) geared_ = false;
}

// A joint that cannot follow the spindle would make another pitch.
std::string ProgramRules::thread_refusal(const ProgramMove& move) const {
  JointVec from, to;
  const double time_s = (move.to - move.from).head<3>().norm() / move.feed.tip_mm_s;
  if (time_s <= 0 || assembly_.map->map(move.from, move.context, from) != KinStatus::kOk ||
      assembly_.map->map(move.to, move.context, to) != KinStatus::kOk)
    return "";
  for (std::size_t i = 0; i < assembly_.plan_joints.size(); ++i) {
    const Joint& joint = assembly_.plan_joints[i];
    const auto k = static_cast<Eigen::Index>(i);
    const double share = std::abs(to[k] - from[k]) / time_s / joint.limit.velocity;
    if (share > 1)
      return fmt::format("joint {} is too slow for this thread at this speed; {:.0f} % of S is possible",
                         joint.name, std::floor(100 / share));
  }
  return "";
}

}  // namespace trn
