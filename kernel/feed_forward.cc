#include "kernel/feed_forward.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

FeedForward::FeedForward(const std::optional<FeedForwardConfig>& config, const Joints& plan_joints,
                         double period_s)
    : config_(config), period_s_(period_s) {
  const auto n = static_cast<Eigen::Index>(plan_joints.size());
  jerk_.setZero(n);
  for (Eigen::Index i = 0; i < n; ++i) jerk_[i] = plan_joints[static_cast<std::size_t>(i)].limit.jerk;
  for (JointVec* v : {&now_.v, &now_.a, &before_.v, &before_.a, &standing_}) v->setZero(n);
  past_.fill(standing_);
  if (!config_) return;
  TRN_CHECK(config_->models.size() == plan_joints.size());
  ahead_s_ = std::max(0.0, config_->delay_periods) * period_s;
  back_ = std::max(0.0, -config_->delay_periods);
}

void FeedForward::keep_position(const JointVec& q) TRN_RT {
  newest_ = (newest_ + past_.size() - 1) % past_.size();
  past_[newest_] = q;
  before_ = now_;
}

void FeedForward::stand(const JointVec& q) TRN_RT {
  if (!on()) return;
  keep_position(q);
  past_.fill(q);
  now_ = {standing_, standing_};
}

// The three-point backward difference of the velocity, the four-point one of the acceleration: exact where
// the jerk is constant. A step of the jerk leaves an error of at most a period's worth of it.
void FeedForward::follow_setpoints(const JointVec& q) TRN_RT {
  if (!on()) return;
  keep_position(q);
  const JointVec d0 = past(0) - past(1), d1 = past(1) - past(2), d2 = past(2) - past(3);
  const JointVec bend = d0 - d1, twist = bend - (d1 - d2);
  now_.a = (bend + twist) / (period_s_ * period_s_);
  now_.v = (d0 + bend / 2 + twist / 3) / period_s_ + ahead_s_ * now_.a;
}

void FeedForward::follow_plan(const MotionQueue& queue, const PlanPlace& place,
                              const RateFollower& rate) TRN_RT {
  if (!on()) return;
  keep_position(past(0));
  RateState state = rate.state();
  const double ahead_s = ahead_s_ > 0 ? state.follow(rate.plan(), ahead_s_) : 0;
  if (!look_at(queue, place, ahead_s, state)) now_ = {standing_, standing_};
}

// False: the plan rests there, or what lies there is not queued yet.
bool FeedForward::look_at(const MotionQueue& queue, PlanPlace place, double ahead_s,
                          const RateState& state) TRN_RT {
  const std::uint64_t front = queue.front_number();
  if (place.block < front) return false;
  std::uint64_t index = place.block - front;
  auto segment = static_cast<std::size_t>(std::max(0, place.segment));
  double t = place.time_s + ahead_s;
  for (const std::uint64_t end = index + kBlocksAhead; index < end; ++index, segment = 0) {
    const MotionBlock* block = queue.ahead(index);
    if (!block || block->segment_count == 0) return false;
    for (; segment < block->segment_count; ++segment) {
      const double duration = block->segments[segment].duration_s;
      if (t < duration) {
        derive(*block, segment, t, state);
        return true;
      }
      t -= duration;
    }
    if (block->ends_at_rest) return false;
  }
  return false;
}

// By plan time, then by time: q' r and q'' r^2 + q' r', with JointMotion's acceleration linear in between.
void FeedForward::derive(const MotionBlock& block, std::size_t segment, double t,
                         const RateState& state) TRN_RT {
  const JointMotion& motion = block.joints[segment];
  const double duration = block.segments[segment].duration_s;
  TRN_CHECK(duration > 0);
  for (Eigen::Index i = 0; i < jerk_.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double v0 = motion.v[k], a0 = motion.a[k];
    const double slope = (static_cast<double>(motion.a_end[k]) - a0) / duration;
    const double v = jerk_[i] * (v0 + t * (a0 + t * slope / 2)), a = jerk_[i] * (a0 + t * slope);
    now_.v[i] = v * state.rate;
    now_.a[i] = a * state.rate * state.rate + v * state.slope;
  }
}

void FeedForward::tell(const JointVec& q, Setpoints& setpoints) TRN_RT {
  if (!on()) return;
  past_[newest_] = q;  // the next period may go on from it in another way
  const JointVec v = now_.v + back_ * (before_.v - now_.v), a = now_.a + back_ * (before_.a - now_.a);
  if (config_->velocity) {
    setpoints.qd = v;
    setpoints.velocity_offset = v;
  }
  if (!config_->torque) return;
  const double moment_s = ahead_s_ - back_ * period_s_;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const auto& model = config_->models[static_cast<std::size_t>(i)];
    if (model) setpoints.force_offset[i] = model->force(q[i] + moment_s * v[i], v[i], a[i]);
  }
}

}  // namespace trn
