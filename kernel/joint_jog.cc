#include "kernel/joint_jog.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kDefaultShare = 0.1;    // of the velocity limit, when a jog names no speed
constexpr double kUse = 0.99;            // of the limits of acceleration and jerk
constexpr double kPeriodsMax = 1 << 16;  // of a mean; a joint that needs more is jogged more slowly
}  // namespace

double jog_target(const JointLimit& limit, double from, double way) TRN_RT {
  return std::clamp(from + way, std::min(limit.min, from), std::max(limit.max, from));
}

void MovingMean::restart(int count) TRN_RT {
  TRN_CHECK(count >= 1 && static_cast<std::size_t>(count) <= values_.size());
  count_ = count;
  filled_ = next_ = 0;
  sum_ = 0;
}

double MovingMean::push(double value) TRN_RT {
  double& oldest = values_[static_cast<std::size_t>(next_)];
  sum_ += value - (filled_ == count_ ? oldest : 0.0);
  oldest = value;
  filled_ = std::min(filled_ + 1, count_);
  next_ = next_ + 1 == count_ ? 0 : next_ + 1;
  return sum_ / count_;
}

JointJog::JointJog(const Joints& joints, double period_s) : joints_(joints), period_s_(period_s) {
  TRN_CHECK(period_s > 0);
  chases_.reserve(joints.size());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double longest_s = time_constant_s(static_cast<int>(i), joints[i].limit.velocity);
    chases_.emplace_back(1 + static_cast<int>(std::min(kPeriodsMax, std::ceil(longest_s / period_s))));
  }
  q_.setZero(static_cast<Eigen::Index>(joints.size()));
}

// Of the first mean, so that neither acceleration nor jerk is beyond its limit; the second need not be
// longer.
double JointJog::time_constant_s(int joint, double speed) const TRN_RT {
  const JointLimit& limit = joints_[static_cast<std::size_t>(joint)].limit;
  return std::max(speed / (kUse * limit.acceleration), std::sqrt(2 * speed / (kUse * limit.jerk)));
}

void JointJog::begin(const JointVec& from) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(from.size()) == joints_.size());
  q_ = from;
  wait_ = kStillPeriods;
  for (Chase& chase : chases_) chase.moves = false;
}

void JointJog::set_off(int joint, double speed) TRN_RT {
  Chase& chase = chases_[static_cast<std::size_t>(joint)];
  const JointLimit& limit = joints_[static_cast<std::size_t>(joint)].limit;
  const double longest_s = std::min(kPeriodsMax * period_s_, time_constant_s(joint, limit.velocity));
  chase.speed_max = std::min({speed, limit.velocity, kUse * limit.acceleration * longest_s,
                              kUse * limit.jerk * longest_s * longest_s / 2});
  const double first_s = time_constant_s(joint, chase.speed_max);
  chase.first_count = std::max(1, static_cast<int>(std::ceil(first_s / period_s_)));
  const double jerk_steps =
      2 * chase.speed_max / (chase.first_count * kUse * limit.jerk * period_s_ * period_s_);
  chase.second_count = std::clamp(static_cast<int>(std::ceil(jerk_steps)), 1, chase.first_count);
  chase.first.restart(chase.first_count);
  chase.second.restart(chase.second_count);
  chase.origin = q_[joint];
  chase.demand = chase.target = chase.direction = 0;
  chase.still = chase.first_count;
  chase.moves = true;
}

void JointJog::move_on(int joint, double way, double speed) TRN_RT {
  TRN_CHECK(joint >= 0 && static_cast<std::size_t>(joint) < joints_.size());
  TRN_CHECK(std::isfinite(way) && speed >= 0);
  Chase& chase = chases_[static_cast<std::size_t>(joint)];
  const JointLimit& limit = joints_[static_cast<std::size_t>(joint)].limit;
  if (way == 0) {
    chase.target = chase.demand;
    return;
  }
  const double wanted = speed > 0 ? speed : kDefaultShare * limit.velocity;
  if (!chase.moves) set_off(joint, wanted);
  chase.speed = std::min(wanted, chase.speed_max);
  chase.target = jog_target(limit, chase.origin + chase.target, way) - chase.origin;
}

void JointJog::stop() TRN_RT {
  for (Chase& chase : chases_) chase.target = chase.demand;
}

// Behind the chase's origin.
double JointJog::follow(Chase& chase, double rate) const TRN_RT {
  const double most = chase.speed * rate * period_s_;
  double way = std::clamp(chase.target - chase.demand, -most, most);
  const bool reverses = (way < 0 && chase.direction > 0) || (way > 0 && chase.direction < 0);
  if (reverses && chase.still < chase.first_count) way = 0;
  chase.still = way == 0 ? chase.still + 1 : 0;
  if (way != 0) chase.direction = way;
  // The last step ends at the target to the bit.
  chase.demand = way == chase.target - chase.demand ? chase.target : chase.demand + way;
  const double mean = chase.second.push(chase.first.push(chase.demand));
  if (chase.demand != chase.target || chase.still < chase.first_count + chase.second_count) return mean;
  chase.moves = false;
  return chase.target;
}

JointVec JointJog::step(double rate) TRN_RT {
  TRN_CHECK(rate >= 0 && rate <= 1);
  if (wait_ > 0) {
    --wait_;
    return q_;
  }
  for (std::size_t i = 0; i < chases_.size(); ++i) {
    Chase& chase = chases_[i];
    if (!chase.moves) continue;
    const double way = follow(chase, rate);
    q_[static_cast<Eigen::Index>(i)] =
        jog_target(joints_[i].limit, chase.origin, way);  // rounding, at a limit
  }
  return q_;
}

bool JointJog::ended() const TRN_RT {
  return std::none_of(chases_.begin(), chases_.end(), [](const Chase& chase) { return chase.moves; });
}

}  // namespace trn
