#include "kernel/spindle_axis.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.h"
#include "core/units.h"
#include "kernel/time_scale.h"

namespace trn {

namespace {

constexpr double kAtSpeed = 1e-9;            // rad/s
constexpr double kSameAngle = 1e-9;          // rad: rounding of degrees is no turn
constexpr PlanShares kRampShares{0.9, 0.6};  // of the limits: what whole periods round stays within them
constexpr double kBrakeShare = 0.7;          // of that jerk: how a change of speed is seen to end

double rad_s_of(double rpm) TRN_RT { return rpm * 2 * kPi / 60; }

}  // namespace

SpindleAxis::SpindleAxis(const Config& config, std::unique_ptr<MachineIo> devices)
    : config_(config), devices_(std::move(devices)), ramp_({config.limits}, config.period_s) {
  TRN_CHECK(config.joint >= 0 && config.period_s > 0);
  TRN_CHECK(config.feedback_periods >= 0 && static_cast<std::size_t>(config.feedback_periods) < kPast);
}

void SpindleAxis::bring_up() {
  if (devices_) devices_->bring_up();
}
void SpindleAxis::shut_down() noexcept {
  if (devices_) devices_->shut_down();
}
std::string SpindleAxis::explain_fault() const { return devices_ ? devices_->explain_fault() : ""; }
std::string SpindleAxis::health() const { return devices_ ? devices_->health() : ""; }

void SpindleAxis::turn(Setpoints& setpoints, bool forward) TRN_RT {
  plan_ = setpoints.q[config_.joint];
  const double before = turn_;
  if (obeyed_) step();
  past_[period_++ % kPast] = turn_;
  const double rate = obeyed_ ? (turn_ - before) / config_.period_s : 0;
  setpoints.q[config_.joint] += turn_;
  setpoints.qd[config_.joint] += rate;
  if (forward) setpoints.velocity_offset[config_.joint] += rate;
}

// The feedback is as old as the bus makes it, and so is the turn that is taken from it.
void SpindleAxis::turn_back(Feedback& feedback) TRN_RT {
  double& q = feedback.q[config_.joint];
  obeyed_ = feedback.state == DriveState::kEnabled;
  measured_ = q;
  if (!obeyed_) lose(feedback.state == DriveState::kHoming);
  const auto age = static_cast<std::size_t>(config_.feedback_periods);
  q -= obeyed_ && period_ > age ? past_[(period_ - 1 - age) % kPast] : turn_;
}

// The drive brakes by itself, or looks for its home. The plan stays where it is.
void SpindleAxis::lose(bool homes) TRN_RT {
  if (speed_ != 0 || going_) placed_ = false;
  speed_ = acceleration_ = 0;
  going_ = reached_ = false;
  placed_ = placed_ || homes;
  if (homes)
    turn_ = 0;
  else if (!placed_)
    turn_ = measured_ - plan_;
  past_.fill(turn_);
}

void SpindleAxis::exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT {
  if (devices_) devices_->exchange(outputs, place, inputs);
  const bool same = outputs.spindle_orients && orients_ && outputs.spindle_deg == told_deg_;
  reached_ = reached_ && same;
  orients_ = outputs.spindle_orients;
  told_deg_ = outputs.spindle_deg;
  const double most = kSpeedShare * config_.limits.limit.velocity;
  wanted_rad_s_ = orients_ ? 0 : std::clamp(config_.sense * rad_s_of(outputs.spindle_rpm), -most, most);
  inputs.spindle_ready = orients_ ? reached_ : !going_ && std::abs(speed_ - wanted_rad_s_) < kAtSpeed;
  inputs.spindle_turns = config_.sense * measured_ / (2 * kPi);
}

void SpindleAxis::step() TRN_RT {
  if (going_) {
    turn_ = ramp_.step(1)[0];
    if (!ramp_.ended()) return;
    turn_ = angle_wanted();
    going_ = false;
    placed_ = true;
    reached_ = orients_ && goal_deg_ == told_deg_;
    return;
  }
  if (speed_ != wanted_rad_s_ || speed_ != 0) placed_ = false;
  change_speed(wanted_rad_s_);
  if (orients_ && !reached_ && speed_ == 0) set_out();
}

// One period towards a speed within acceleration and jerk.
void SpindleAxis::change_speed(double wanted) TRN_RT {
  const JointLimit& limit = config_.limits.limit;
  const double dt = config_.period_s, jerk = kRampShares.jerk * limit.jerk, jerk_step = jerk * dt;
  const double before = speed_, missing = wanted - speed_;
  // a2 / 2 j is what the speed still gains while the acceleration goes to zero, so that much must be missing.
  const double most = std::min(kRampShares.acceleration * limit.acceleration,
                               std::sqrt(2 * kBrakeShare * jerk * std::abs(missing)));
  const double aim = std::copysign(most, missing);
  acceleration_ += std::clamp(aim - acceleration_, -jerk_step, jerk_step);
  speed_ += (acceleration_ + std::exchange(last_acceleration_, acceleration_)) / 2 * dt;
  const bool there = (wanted - speed_) * missing <= 0 || std::abs(wanted - speed_) < jerk_step * dt / 2;
  if (there && std::abs(acceleration_) <= jerk_step) {
    speed_ = wanted;
    acceleration_ = last_acceleration_ = 0;
  }
  turn_ += (before + speed_) / 2 * dt;
}

// The nearest turn with that angle.
double SpindleAxis::angle_wanted() const TRN_RT {
  const double angle = config_.sense * kRadPerDeg * goal_deg_;
  const double there = turn_ + std::remainder(angle - plan_ - turn_, 2 * kPi);
  // As an axis it has made whole turns, to the last digit.
  const double whole = 2 * kPi * std::round(there / (2 * kPi));
  return std::abs(there - whole) < kSameAngle ? whole : there;
}

void SpindleAxis::set_out() TRN_RT {
  goal_deg_ = told_deg_;
  going_ = true;
  JointVec from(1), way(1);
  from[0] = turn_;
  way[0] = angle_wanted() - turn_;
  ramp_.begin_way(from, way, 1);
}

}  // namespace trn
