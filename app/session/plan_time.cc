#include "app/session/plan_time.h"

#include <limits>

namespace trn {

PlanTime::Kind PlanTime::kind_of(const MotionBlock& block) {
  if (block.segment_count == 0) return {};
  return {block.rapid, block.overrides.feed, block.overrides.adaptive, block.overrides.follows_spindle()};
}

void PlanTime::add(const MotionBlock& block) {
  double duration_s = block.event.kind == QueueEvent::Kind::kDwell ? block.event.value : 0;
  for (int i = 0; i < block.segment_count; ++i)
    duration_s += block.segments[static_cast<std::size_t>(i)].duration_s;
  add(kind_of(block), duration_s);
}

PlanTime PlanTime::operator-(const PlanTime& other) const {
  PlanTime out;
  for (std::size_t i = 0; i < shares_s_.size(); ++i) out.shares_s_[i] = shares_s_[i] - other.shares_s_[i];
  out.rapid_runs_ = rapid_runs_ - other.rapid_runs_;
  return out;
}

double PlanTime::total_s() const { return real_s({}); }

double PlanTime::rate(Kind kind, const OverrideShares& shares) {
  if (kind.rapid) return shares.rapid;
  return (kind.feed ? shares.feed : 1) * (kind.adaptive ? shares.adaptive : 1) *
         (kind.spindle ? shares.spindle : 1);
}

double PlanTime::real_s(const OverrideShares& shares) const {
  double sum = 0;
  const auto put = [&](Kind kind) {
    const double share_s = shares_s_[index(kind)], speed = rate(kind, shares);
    if (share_s > 0) sum += speed > 0 ? share_s / speed : std::numeric_limits<double>::infinity();
  };
  put({.rapid = true});
  for (const bool feed : {false, true})
    for (const bool adaptive : {false, true})
      for (const bool spindle : {false, true}) put({false, feed, adaptive, spindle});
  return sum;
}

}  // namespace trn
