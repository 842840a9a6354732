#include "kernel/joint_ramp.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kFast = 1e12;   // no limit at all
constexpr double kNoWay = 1e-9;  // mm, rad: keeps the division by a joint's way finite
}  // namespace

JointRamp::JointRamp(const Joints& joints, double period_s, PlanShares shares)
    : joints_(joints), shares_(shares), time_scale_(joints, shares, period_s) {
  from_.setZero(static_cast<Eigen::Index>(joints.size()));
  way_ = from_;
}

// The curve runs from 0 to 1; each joint's limit, divided by its way, is a limit of the curve.
void JointRamp::begin_way(const JointVec& from, const JointVec& way, double rate) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(from.size()) == joints_.size() && from.size() == way.size());
  TRN_CHECK(way.allFinite());
  double velocity = kFast, acceleration = kFast, jerk = kFast;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointLimit& limit = joints_[i].limit;
    const double part = std::abs(way[static_cast<Eigen::Index>(i)]) + kNoWay;
    velocity = std::min(velocity, shares_.velocity * limit.velocity / part);
    acceleration = std::min(acceleration, shares_.acceleration * limit.acceleration / part);
    jerk = std::min(jerk, shares_.jerk * limit.jerk / part);
  }
  curve_ = SCurve(1, velocity, acceleration, jerk);
  from_ = from;
  way_ = way;
  time_s_ = 0;
  time_scale_.set_target(rate);
  time_scale_.restart();
}

JointVec JointRamp::step(double rate_target) TRN_RT {
  time_scale_.set_target(rate_target);
  time_s_ += time_scale_.step();
  TRN_CHECK(time_s_ >= 0);
  return from_ + curve_.at(time_s_) * way_;
}

}  // namespace trn
