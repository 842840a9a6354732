#include "sim/simulated_joint.h"

#include <algorithm>
#include <cmath>

namespace trn {

SimulatedJoint::SimulatedJoint(const Config& config)
    : config_(config),
      servo_(config.servo),
      plant_{config.start, 0, config.start},
      encoder_offset_(config.homed ? config.encoder_offset : -config.start),
      reported_(config.start + encoder_offset_),
      homed_(config.homed),
      load_(config.load) {
  if (config.mechanism) mechanism_.emplace(*config.mechanism);
  stand_still();
}

// The brake holds it; a drive that gets power again begins without an integral part.
void SimulatedJoint::stand_still() TRN_RT { moving_ = {plant_.x, 0, plant_.x, 0, 0, 0}; }

void SimulatedJoint::enable() TRN_RT {
  if (state_ != DriveState::kOff) return;
  state_ = DriveState::kStarting;
  periods_ = 0;
}

void SimulatedJoint::disable() TRN_RT {
  state_ = DriveState::kOff;
  v_target_ = 0;
  // Without power the brake is closed, so the axis stands at once; one that hangs has a brake of its own.
  if (!load_.hangs()) plant_.v = 0;
  plant_.target = plant_.x;
  stand_still();
}

void SimulatedJoint::reset() TRN_RT {
  if (state_ != DriveState::kFault) return;
  fault_ = Fault::kOk;
  disable();
}

void SimulatedJoint::home() TRN_RT {
  if (state_ != DriveState::kEnabled) return;
  state_ = DriveState::kHoming;
  homing_ = Homing::kSearch;
  homed_ = false;
  periods_ = 0;
}

void SimulatedJoint::quick_stop(bool holds) TRN_RT {
  holds_ = holds;
  // It does not move yet, so there is nothing to brake.
  if (state_ == DriveState::kStarting) disable();
  if (state_ == DriveState::kEnabled || state_ == DriveState::kHoming) state_ = DriveState::kQuickStop;
}

void SimulatedJoint::power_cycle() TRN_RT {
  disable();
  fault_ = Fault::kOk;
  homed_ = config_.homed;
  // An incremental encoder counts from zero wherever it wakes up.
  encoder_offset_ = homed_ ? config_.encoder_offset : -plant_.x;
  reported_ = plant_.x + encoder_offset_;
}

void SimulatedJoint::take_position(double q) TRN_RT {
  encoder_offset_ = q - plant_.x;
  reported_ = q;
  homed_ = true;
}

void SimulatedJoint::begin_homing() TRN_RT {
  if (state_ != DriveState::kEnabled) return;
  state_ = DriveState::kHoming;
  homed_ = false;
  periods_ = 0;
}

void SimulatedJoint::move_itself(double v_wanted, double acceleration) TRN_RT {
  if (state_ != DriveState::kHoming || lost_) return step(reported_);
  const double x_before = plant_.x;
  drive_itself(v_wanted, acceleration);
  if (load_.hangs()) hang(x_before);
  if (std::abs(plant_.x - plant_.target) > config_.following_error_max)
    fail(Fault::kFollowingError);
  else if (++periods_ > config_.homing_periods_max)
    fail(Fault::kHomingFailed);
  reported_ = plant_.x + encoder_offset_;
}

void SimulatedJoint::give_up_homing() TRN_RT {
  if (state_ == DriveState::kHoming) state_ = DriveState::kEnabled;
}

void SimulatedJoint::take_home(double place, double reads) TRN_RT {
  encoder_offset_ = reads - place;
  reported_ = plant_.x + encoder_offset_;
  homed_ = true;
  state_ = DriveState::kEnabled;
}

void SimulatedJoint::fail(Fault fault) TRN_RT {
  if (state_ == DriveState::kFault) return;
  fault_ = fault;
  state_ = DriveState::kFault;
}

bool SimulatedJoint::on_limit_switch() const TRN_RT {
  return plant_.x < config_.switch_min || plant_.x > config_.switch_max;
}

bool SimulatedJoint::has_torque() const TRN_RT {
  return state_ == DriveState::kEnabled || state_ == DriveState::kHoming ||
         state_ == DriveState::kQuickStop || (state_ == DriveState::kFault && v_target_ != 0);
}

// A closed brake holds it against the drive as well. Without torque it falls.
void SimulatedJoint::hang(double x_before) TRN_RT {
  load_.step();
  if (load_.braked()) {
    plant_.x = x_before;
    plant_.v = 0;
    stand_still();
  } else if (!has_torque()) {
    plant_.v += load_.gain();
    plant_.x = x_before + plant_.v * config_.servo.period_s;
    plant_.target = plant_.x;
    stand_still();
  }
}

void SimulatedJoint::step(double q, const Reference& reference) TRN_RT {
  const double x_before = plant_.x;
  step_drive(q, reference);
  if (load_.hangs()) hang(x_before);
  if (!lost_) reported_ = plant_.x + encoder_offset_;
}

void SimulatedJoint::step_drive(double q, const Reference& reference) TRN_RT {
  if (lost_) {  // nobody hears its answers any more; it watches the bus, and brakes
    if (state_ != DriveState::kOff) step_brake();
    return;
  }
  switch (state_) {
    case DriveState::kOff:
      break;
    case DriveState::kStarting:
      if (++periods_ > config_.start_up_periods) state_ = DriveState::kEnabled;
      break;
    case DriveState::kEnabled:
      step_enabled(q, reference);
      break;
    case DriveState::kHoming:
      step_homing();
      break;
    case DriveState::kQuickStop:
    case DriveState::kFault:
    case DriveState::kLost:
      if (!load_.hangs() || has_torque()) step_brake();
      break;
  }
}

void SimulatedJoint::follow(double target, const Reference& reference) TRN_RT {
  v_target_ = (target - plant_.target) / config_.servo.period_s;
  const double x = plant_.x;
  if (mechanism_) {
    mechanism_->step(plant_.target, target, reference, moving_);
    const bool by_place = reference.loop == Reference::Loop::kPosition;
    plant_ = {moving_.x, moving_.v, by_place ? target : moving_.x};
  } else {
    servo_.step(target, plant_);
  }
  if (!stuck_) return;
  plant_.x = x;
  plant_.v = 0;
  stand_still();
}

void SimulatedJoint::drive_itself(double v_wanted, double acceleration) TRN_RT {
  const double dv = acceleration * config_.servo.period_s;
  const double v = v_target_ + std::clamp(v_wanted - v_target_, -dv, dv);
  follow(plant_.target + v * config_.servo.period_s);
  v_target_ = v;  // as asked, free of rounding
}

void SimulatedJoint::step_enabled(double q, const Reference& reference) TRN_RT {
  // Setpoints are in the encoder's own count, the plant in true places. The two differ until the joint is
  // homed.
  const double target = q - encoder_offset_;
  const double outward = target - plant_.target;
  // A setpoint that jumps is a following error before the axis has moved. What the joint's acceleration makes
  // of the way of a period is no jump, which counts where periods are long.
  const double period_s = config_.servo.period_s;
  const double jump = outward - v_target_ * period_s;
  const double jump_max = config_.following_error_max + config_.acceleration_max * period_s * period_s;
  if (std::abs(jump) > jump_max) return fail(Fault::kFollowingError);
  follow(target, reference);
  if (std::abs(plant_.x - plant_.target) > config_.following_error_max) fail(Fault::kFollowingError);
  // standing on a switch is no fault, or nobody could jog away from it
  const bool leaves =
      (plant_.x > config_.switch_max && outward > 0) || (plant_.x < config_.switch_min && outward < 0);
  if (leaves) fail(Fault::kLimitSwitch);
}

void SimulatedJoint::step_homing() TRN_RT {
  step_homing_phase();
  if (state_ != DriveState::kHoming) return;
  if (std::abs(plant_.x - plant_.target) > config_.following_error_max)
    fail(Fault::kFollowingError);
  else if (on_limit_switch() && !on_home_switch())
    fail(Fault::kHomingFailed);
  else if (++periods_ > config_.homing_periods_max)
    fail(Fault::kHomingFailed);
}

// Search the switch downwards, back off it upwards, go on slowly to the index, and take the position there.
void SimulatedJoint::step_homing_phase() TRN_RT {
  const double a = config_.acceleration_homing;
  switch (homing_) {
    case Homing::kSearch:
      drive_itself(-config_.speed_search, a);
      if (on_home_switch()) homing_ = Homing::kBackOff;
      break;
    case Homing::kBackOff:
      drive_itself(config_.speed_search, a);
      if (!on_home_switch()) homing_ = Homing::kIndex;
      break;
    case Homing::kIndex:
      drive_itself(config_.speed_index, a);
      if (plant_.x >= config_.home + config_.index_distance) homing_ = Homing::kStop;
      break;
    case Homing::kStop:
      drive_itself(0, a);
      if (v_target_ != 0) break;
      // From here on the encoder tells the true place.
      encoder_offset_ = 0;
      homed_ = true;
      state_ = DriveState::kEnabled;
      break;
  }
}

void SimulatedJoint::step_brake() TRN_RT {
  drive_itself(0, config_.quick_stop_deceleration);
  const bool at_rest =
      v_target_ == 0 && std::abs(plant_.x - plant_.target) < 0.1 * config_.following_error_max;
  // A stuck axis never comes near its target. It stands all the same.
  const bool blocked = v_target_ == 0 && stuck_;
  if (!at_rest && !blocked) return;
  plant_.v = 0;  // the brake closes
  plant_.target = plant_.x;
  stand_still();
  if (state_ == DriveState::kQuickStop && !holds_) state_ = DriveState::kOff;
}

}  // namespace trn
