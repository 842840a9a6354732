#include "sim/canopen/emulated_drive.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/fault.h"
#include "core/ports.h"

namespace trn {

namespace {

constexpr std::uint16_t kFollowingErrorCode = 0x8611, kLimitSwitchCode = 0x8612, kHomingCode = 0x8613;
constexpr int kIndexMethod = 5, kHereMethod = 37, kHereMethodOld = 35;

std::int64_t mode_number(Cia402Mode mode) { return static_cast<std::int64_t>(mode); }

}  // namespace

std::int64_t EmulatedDrive::Cell::get() const {
  return bytes ? get_le_signed(bytes->data(), static_cast<int>(bytes->size())) : 0;
}

void EmulatedDrive::Cell::set(std::int64_t value) const {
  if (bytes) put_le(bytes->data(), static_cast<int>(bytes->size()), static_cast<std::uint64_t>(value));
}

EmulatedDrive::EmulatedDrive(const Config& config, ObjectStore& store)
    : config_(config),
      store_(store),
      joint_(config.joint),
      control_(store, {0x6040, 0}),
      status_(store, {0x6041, 0}),
      mode_(store, {0x6060, 0}),
      mode_display_(store, {0x6061, 0}),
      position_(store, {0x6064, 0}),
      velocity_(store, {0x606C, 0}),
      target_position_(store, {0x607A, 0}),
      target_velocity_(store, {0x60FF, 0}),
      interpolation_(store, {0x60C1, 1}),
      inputs_(store, {0x60FD, 0}),
      touch_function_(store, {0x60B8, 0}),
      touch_status_(store, {0x60B9, 0}),
      touch_rise_(store, {0x60BA, 0}),
      touch_fall_(store, {0x60BB, 0}) {
  q_before_ = q_target_ = joint_.measured();
  report();
}

void EmulatedDrive::power_cycle() {
  joint_.power_cycle();
  state_ = Cia402State::kSwitchOnDisabled;
  control_before_ = 0;
  homing_ = attained_ = homing_error_ = false;
  error_code_ = 0;
  q_before_ = q_target_ = joint_.measured();
  report();
}

void EmulatedDrive::drop() {
  if (state_ != Cia402State::kOperationEnabled) return;
  joint_.disable();
  state_ = Cia402State::kSwitchOnDisabled;
}

void EmulatedDrive::raise(std::uint16_t code) {
  error_code_ = code;
  emergency_ = code;
}

void EmulatedDrive::fail(std::uint16_t code) {
  if (state_ == Cia402State::kFault || state_ == Cia402State::kFaultReactionActive) return;
  joint_.fail(Fault::kDriveFault);
  state_ = Cia402State::kFaultReactionActive;
  raise(code);
}

void EmulatedDrive::lose_connection(std::uint16_t code) {
  // A drive without power has nothing to bring to a stand.
  if (powered()) fail(code);
}

int EmulatedDrive::take_emergency() { return std::exchange(emergency_, -1); }

void EmulatedDrive::step() {
  const auto control = static_cast<std::uint16_t>(control_.get());
  // The state first: in the period in which it is enabled the drive takes its first target.
  obey_controlword(control);
  mode_now_ = mode_.get();
  if (state_ == Cia402State::kOperationEnabled && joint_.state() == DriveState::kEnabled) {
    step_homing(control);
    q_target_ = target();
  } else {
    // Switched off, the target goes with the axis, so that nothing jumps when power comes back.
    q_target_ = joint_.measured();
    profile_speed_ = 0;
  }
  q_before_ = joint_.measured();
  joint_.step(q_target_);
  follow_joint();
  step_touch();
  control_before_ = control;
  report();
}

// Table of commands, CiA 402-2, 8.4.1; one transition a period
void EmulatedDrive::obey_controlword(std::uint16_t control) {
  using S = Cia402State;
  // An edge: a master that holds the bit high resets once.
  const bool reset = (control & ~control_before_) & controlword::kFaultReset;
  if (state_ == S::kFault) {
    if (!reset) return;
    joint_.reset();
    state_ = S::kSwitchOnDisabled;
    homing_error_ = false;
    // An emergency message with the code 0 tells that the error is gone (CiA 301).
    raise(0);
    return;
  }
  if (state_ == S::kFaultReactionActive || state_ == S::kNotReady) return;
  const unsigned low = control & 0x0Fu;
  // In the order of the command table: bit 1 (voltage) at 0 beats all others, then bit 2 (quick stop), bit 0
  // and bit 3.
  if (!(low & 2)) {
    if (powered()) joint_.disable();
    state_ = S::kSwitchOnDisabled;
  } else if (!(low & 4)) {
    if (state_ == S::kOperationEnabled) {
      joint_.quick_stop();
      state_ = S::kQuickStopActive;
    } else if (state_ != S::kQuickStopActive) {
      state_ = S::kSwitchOnDisabled;
    }
    // Nothing leads on from Quick Stop Active but Disable Voltage (0x605A = 2), and its own end in
    // `follow_joint`.
  } else if (state_ == S::kQuickStopActive) {
    return;
  } else if (!(low & 1)) {
    if (powered()) joint_.disable();
    state_ = S::kReadyToSwitchOn;
  } else if (state_ == S::kReadyToSwitchOn) {
    state_ = S::kSwitchedOn;
  } else if (state_ == S::kSwitchedOn && (low & 8)) {
    joint_.enable();
    state_ = S::kOperationEnabled;
  } else if (state_ == S::kOperationEnabled && !(low & 8)) {
    joint_.disable();
    state_ = S::kSwitchedOn;
  }
}

void EmulatedDrive::follow_joint() {
  using S = Cia402State;
  const bool faulty = state_ == S::kFault || state_ == S::kFaultReactionActive;
  // The plant finds faults by itself (a lag, a switch, a search in vain), and the drive tells of them with
  // the code that CiA 402 has for each.
  if (joint_.state() == DriveState::kFault && !faulty) {
    state_ = S::kFaultReactionActive;
    homing_error_ = joint_.fault() == Fault::kHomingFailed;
    homing_ = false;
    raise(joint_.fault() == Fault::kFollowingError ? kFollowingErrorCode
          : joint_.fault() == Fault::kLimitSwitch  ? kLimitSwitchCode
                                                   : kHomingCode);
  }
  // First it brakes, and only at rest it is in Fault and can be reset.
  if (state_ == S::kFaultReactionActive && !joint_.braking()) state_ = S::kFault;
  if (state_ == S::kQuickStopActive && joint_.state() == DriveState::kOff) state_ = S::kSwitchOnDisabled;
  if (homing_ && joint_.state() == DriveState::kEnabled && joint_.homed()) {
    homing_ = false;
    attained_ = true;
  }
}

double EmulatedDrive::target() {
  if (mode_now_ == mode_number(Cia402Mode::kCyclicPosition)) return cyclic_target();
  // Cyclic velocity: the speed is added up from the last target, as the loop in a drive does.
  if (mode_now_ == mode_number(Cia402Mode::kCyclicVelocity))
    return q_target_ + counts_to_unit(static_cast<double>(target_velocity_.get())) * config_.period_s;
  // Interpolation runs only while bit 4 enables it; else the drive holds its last target.
  if (mode_now_ == mode_number(Cia402Mode::kInterpolatedPosition) && (control_.get() & controlword::kBit4))
    return counts_to_unit(static_cast<double>(interpolation_.get()));
  if (mode_now_ == mode_number(Cia402Mode::kProfilePosition)) return profile_target();
  return q_target_;
}

// A straight line to the last target, over the time until the next one
double EmulatedDrive::cyclic_target() {
  const double goal = counts_to_unit(static_cast<double>(target_position_.get()));
  // A new target begins a new line. One that comes again lets the line run out.
  if (goal != cyclic_goal_) steps_left_ = config_.interpolation_steps;
  cyclic_goal_ = goal;
  if (steps_left_ <= 1) return goal;
  return q_target_ + (goal - q_target_) / steps_left_--;
}

// Profile position, one setpoint at a time (CiA 402-2, 9.2): a trapezoid towards the last accepted target
double EmulatedDrive::profile_target() {
  const bool rising = (control_.get() & ~control_before_) & controlword::kBit4;
  if (rising) profile_goal_ = counts_to_unit(static_cast<double>(target_position_.get()));
  acknowledge_ = control_.get() & controlword::kBit4;
  const double scale = std::abs(config_.counts_per_unit), dt = config_.period_s;
  const double a = std::max(1.0, static_cast<double>(store_.integer({0x6083, 0}))) / scale;
  const double v_max = std::max(1.0, static_cast<double>(store_.integer({0x6081, 0}))) / scale;
  const double way = profile_goal_ - q_target_;
  // The speed from which the way that is left is just enough to stop: v^2 = 2 a s.
  const double v_wanted = std::copysign(std::min(v_max, std::sqrt(2 * a * std::abs(way))), way);
  profile_speed_ += std::clamp(v_wanted - profile_speed_, -a * dt, a * dt);
  const double step = profile_speed_ * dt;
  return std::abs(way) <= std::abs(step) ? profile_goal_ : q_target_ + step;
}

void EmulatedDrive::step_homing(std::uint16_t control) {
  if (mode_now_ != mode_number(Cia402Mode::kHoming)) return;
  const bool rising = (control & ~control_before_) & controlword::kBit4;
  if (!rising) return;
  attained_ = homing_error_ = false;
  const std::int64_t method = store_.integer({0x6098, 0});
  if (method == kIndexMethod) {
    // Method 5: the home switch at the lower end, then the index pulse.
    homing_ = true;
    joint_.home();
  } else if (method == kHereMethod || method == kHereMethodOld) {
    // Method 37, and 35 as it was numbered before: home is where the axis stands.
    joint_.take_position(counts_to_unit(static_cast<double>(store_.integer({0x607C, 0}))));
    q_target_ = joint_.measured();
    attained_ = true;
  } else {
    homing_error_ = true;
  }
}

// Switched off it forgets, switched on it waits (CiA 402-2, objects 0x60B8 and 0x60B9)
void EmulatedDrive::step_touch() {
  const bool on = touch_function_.get() & 1;
  if (!on || !(touch_status_.get() & 1)) touch_status_.set(on ? 1 : 0);
}

void EmulatedDrive::touch(bool contact, double q) {
  if (contact == contact_) return;
  contact_ = contact;
  const std::int64_t function = touch_function_.get(), status = touch_status_.get();
  const std::int64_t wanted = contact ? 1 << 4 : 1 << 5, stored = contact ? 1 << 1 : 1 << 2;
  // Only the edge that is armed, and only the first one: a bouncing contact must not write over it.
  if (!(status & 1) || !(function & wanted) || (status & stored)) return;
  (contact ? touch_rise_ : touch_fall_).set(std::llround(q * config_.counts_per_unit));
  touch_status_.set(status | stored);
}

void EmulatedDrive::report() {
  std::uint16_t status = cia402_status_bits(state_) | statusword::kRemote | statusword::kVoltage;
  if (state_ == Cia402State::kSwitchOnDisabled) status &= static_cast<std::uint16_t>(~0x20);
  const bool homing_mode = mode_now_ == mode_number(Cia402Mode::kHoming);
  const bool enabled = state_ == Cia402State::kOperationEnabled;
  if (homing_mode) {
    if (attained_ && !homing_) status |= statusword::kBit12 | statusword::kTargetReached;
    if (homing_error_) status |= statusword::kBit13;
  } else if (mode_now_ == mode_number(Cia402Mode::kProfilePosition)) {
    if (acknowledge_) status |= statusword::kBit12;
    if (q_target_ == profile_goal_) status |= statusword::kTargetReached;
  } else if (enabled) {
    status |= statusword::kBit12;
  }
  if (error_code_ == kFollowingErrorCode) status |= statusword::kBit13;
  if (joint_.on_limit_switch()) status |= statusword::kInternalLimit;
  status_.set(status);
  mode_display_.set(mode_now_);
  const double q = joint_.measured();
  position_.set(std::llround(q * config_.counts_per_unit));
  velocity_.set(std::llround((q - q_before_) / config_.period_s * config_.counts_per_unit));
  // Limit switches are named by the drive's own direction, which is the other way round on a reversed axis.
  const bool positive = config_.counts_per_unit > 0 ? q > 0 : q < 0;
  const std::int64_t touch = contact_ ? std::int64_t{1} << config_.touch_input_bit : 0;
  inputs_.set((joint_.on_limit_switch() ? (positive ? 2 : 1) : 0) | touch);
}

}  // namespace trn
