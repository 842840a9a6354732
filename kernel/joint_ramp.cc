#include "kernel/joint_ramp.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr PlanShares kShares{0.9, 0.8};  // of the limits; the rest stops the ramp at any moment
constexpr double kJogShare = 0.1;        // of the velocity limit when a jog names no speed
constexpr double kFast = 1e12;           // no limit at all
constexpr double kNoWay = 1e-9;          // mm, rad: keeps the division by a joint's way finite
}  // namespace

double jog_target(const JointLimit& limit, double from, double way) TRN_RT {
  return std::clamp(from + way, std::min(limit.min, from), std::max(limit.max, from));
}

JointRamp::JointRamp(const Joints& joints, double period_s)
    : joints_(joints), time_scale_(joints, kShares, period_s) {
  from_.setZero(static_cast<Eigen::Index>(joints.size()));
  way_ = from_;
}

void JointRamp::begin(double rate) TRN_RT {
  time_s_ = 0;
  time_scale_.set_target(rate);
  time_scale_.restart();
}

void JointRamp::begin_jog(const JointVec& from, int joint, double way, double speed, double rate) TRN_RT {
  const JointLimit& limit = joints_[static_cast<std::size_t>(joint)].limit;
  from_ = from;
  TRN_CHECK(static_cast<std::size_t>(joint) < joints_.size());
  TRN_CHECK(static_cast<std::size_t>(from.size()) == joints_.size());
  way_.setZero();
  way_[joint] = 1;
  const double distance = jog_target(limit, from[joint], way) - from[joint];
  const double wanted = speed > 0 ? speed : kJogShare * limit.velocity;
  curve_ = SCurve(distance, std::min(wanted, limit.velocity), kShares.acceleration * limit.acceleration,
                  kShares.jerk * limit.jerk);
  begin(rate);
}

// The curve runs from 0 to 1; each joint's limit, divided by its way, is a limit of the curve.
void JointRamp::begin_way(const JointVec& from, const JointVec& way, double rate) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(from.size()) == joints_.size() && from.size() == way.size());
  TRN_CHECK(way.allFinite());
  double velocity = kFast, acceleration = kFast, jerk = kFast;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointLimit& limit = joints_[i].limit;
    const double part = std::abs(way[static_cast<Eigen::Index>(i)]) + kNoWay;
    velocity = std::min(velocity, limit.velocity / part);
    acceleration = std::min(acceleration, kShares.acceleration * limit.acceleration / part);
    jerk = std::min(jerk, kShares.jerk * limit.jerk / part);
  }
  curve_ = SCurve(1, velocity, acceleration, jerk);
  from_ = from;
  way_ = way;
  begin(rate);
}

JointVec JointRamp::step(double rate_target) TRN_RT {
  time_scale_.set_target(rate_target);
  time_s_ += time_scale_.step();
  TRN_CHECK(time_s_ >= 0);
  return from_ + curve_.at(time_s_) * way_;
}

}  // namespace trn
