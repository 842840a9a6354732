#include "sim/canopen/emulated_drive.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/fault.h"
#include "core/ports.h"

namespace trn {

namespace {

constexpr int kStandingPeriods = 5;
constexpr double kSwitchWidth = 10;  // mm or rad
constexpr std::uint16_t kFollowingErrorCode = 0x8611, kLimitSwitchCode = 0x8612, kHomingCode = 0x8613;

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
      touch_fall_(store, {0x60BB, 0}),
      velocity_offset_(store, {0x60B1, 0}),
      torque_offset_(store, {0x60B2, 0}),
      target_torque_(store, {0x6071, 0}),
      torque_(store, {0x6077, 0}) {
  inputs_on_ = config.inputs_on;
  q_before_ = q_target_ = joint_.measured();
  report();
}

void EmulatedDrive::set_sto(bool active) {
  sto_ = active;
  if (!active || state_ == Cia402State::kFault) return;
  joint_.disable();
  state_ = Cia402State::kSwitchOnDisabled;
}

void EmulatedDrive::step_brake_output() {
  if (config_.brake_bit < 0 || !store_.has({0x60FE, 1})) return;
  const bool on = store_.integer({0x60FE, 1}) >> config_.brake_bit & 1;
  const bool enabled = store_.integer({0x60FE, 2}) >> config_.brake_bit & 1;
  joint_.set_brake((on && enabled) != config_.brake_inverted);
}

void EmulatedDrive::power_cycle() {
  joint_.power_cycle();
  state_ = Cia402State::kSwitchOnDisabled;
  control_before_ = 0;
  homing_.end();
  attained_ = homing_error_ = false;
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
  store_.set({0x603F, 0}, code);
  if (!std::exchange(quiet_, false)) emergency_ = code;
}

void EmulatedDrive::fail(std::uint16_t code) {
  if (state_ == Cia402State::kFault || state_ == Cia402State::kFaultReactionActive) return;
  joint_.fail(Fault::kDriveFault);
  state_ = Cia402State::kFaultReactionActive;
  raise(code);
}

void EmulatedDrive::lose_connection(std::uint16_t code) {
  // Nobody switches its outputs any more: they go off, and a brake on one closes.
  if (store_.has({0x60FE, 1})) store_.set({0x60FE, 1}, 0);
  // A drive without power has nothing to bring to a stand.
  if (powered()) fail(code);
}

int EmulatedDrive::take_emergency() { return std::exchange(emergency_, -1); }

void EmulatedDrive::step() {
  const auto control = static_cast<std::uint16_t>(control_.get());
  // The state first: in the period in which it is enabled the drive takes its first target.
  obey_controlword(control);
  step_brake_output();
  standing_ = joint_.measured() == q_before_ ? standing_ + 1 : 0;
  if (!config_.habits.stands_to_switch || !powered() || standing_ >= kStandingPeriods)
    mode_now_ = mode_.get();
  if (state_ == Cia402State::kOperationEnabled && joint_.state() == DriveState::kEnabled) {
    begin_homing(control);
    if (!ignores_) q_target_ = target();
  } else {
    // Switched off, the target goes with the axis, so that nothing jumps when power comes back.
    q_target_ = joint_.measured();
    profile_speed_ = 0;
  }
  q_before_ = joint_.measured();
  move_joint();
  follow_joint();
  step_touch();
  control_before_ = control;
  report();
}

// Out of Operation Enabled: at once, or by a ramp first (option codes 0x605B and 0x605C).
void EmulatedDrive::let_go(ObjectKey option) {
  store_.integer(option) == 1 ? joint_.quick_stop() : joint_.disable();
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
  if (state_ == S::kFaultReactionActive || state_ == S::kNotReady || sto_) return;
  const unsigned low = control & 0x0Fu;
  // In the order of the command table: bit 1 (voltage) at 0 beats all others, then bit 2 (quick stop), bit 0
  // and bit 3.
  if (!(low & 2)) {
    if (powered()) joint_.disable();
    state_ = S::kSwitchOnDisabled;
  } else if (!(low & 4)) {
    if (state_ == S::kOperationEnabled) {
      joint_.quick_stop(store_.integer({0x605A, 0}) >= 5);
      state_ = S::kQuickStopActive;
    } else if (state_ != S::kQuickStopActive) {
      state_ = S::kSwitchOnDisabled;
    }
    // Nothing leads on from Quick Stop Active but Disable Voltage (0x605A = 2), and its own end in
    // `follow_joint`.
  } else if (state_ == S::kQuickStopActive) {
    return;
  } else if (!(low & 1)) {
    if (powered()) let_go({0x605B, 0});
    state_ = S::kReadyToSwitchOn;
  } else if (state_ == S::kReadyToSwitchOn) {
    state_ = S::kSwitchedOn;
  } else if (state_ == S::kSwitchedOn && (low & 8)) {
    joint_.enable();
    state_ = S::kOperationEnabled;
  } else if (state_ == S::kOperationEnabled && !(low & 8)) {
    let_go({0x605C, 0});
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
    homing_.end(homing_error_ ? "the emulated axis searched for longer than homing_timeout_s" : "");
    raise(joint_.fault() == Fault::kFollowingError ? kFollowingErrorCode
          : joint_.fault() == Fault::kLimitSwitch  ? kLimitSwitchCode
                                                   : kHomingCode);
  }
  // First it brakes, and only at rest it is in Fault and can be reset.
  if (state_ == S::kFaultReactionActive && !joint_.braking()) state_ = S::kFault;
  if (state_ == S::kQuickStopActive && joint_.state() == DriveState::kOff) state_ = S::kSwitchOnDisabled;
}

// While it homes, the drive goes its own way.
void EmulatedDrive::move_joint() {
  if (joint_.state() != DriveState::kHoming) homing_.end();
  if (!homes_by_itself()) return joint_.step(q_target_, reference());
  const double speed = homing_.step(joint_.true_place(), joint_.home_switch_dead());
  joint_.move_itself(speed, homing_acceleration_);
  if (joint_.state() != DriveState::kHoming || !homing_.stopping() || joint_.wants_to_move()) return;
  // Without a home offset the encoder reads the true place there.
  const bool offset = store_.has({0x607C, 0});
  const double reads =
      (config_.offset_is_zero ? -1 : 1) * counts_to_unit(static_cast<double>(store_.integer({0x607C, 0})));
  homing_error_ = homing_.failed();
  attained_ = !homing_error_;
  // With a homing error it stands enabled (CiA 402-2, clause 11).
  attained_ ? joint_.take_home(homing_.home(), offset ? reads : homing_.home()) : joint_.give_up_homing();
  homing_.end();
  // It stands where it is, in the new count: the old one would be a leap.
  q_before_ = q_target_ = joint_.measured();
}

// What a drive with a mechanism is told besides the place: in the cyclic modes the offsets 0x60B1 and 0x60B2
// are added behind its loops (CiA 402-2, clauses 13 to 15).
SimulatedJoint::Reference EmulatedDrive::reference() const {
  using Loop = SimulatedJoint::Reference::Loop;
  const bool follows = state_ == Cia402State::kOperationEnabled && !ignores_;
  if (!joint_.has_mechanism() || !follows) return {};
  const auto speed = [&](const Cell& cell) {
    return counts_to_unit(static_cast<double>(cell.get()) * config_.units.counts_s(store_));
  };
  const auto force = [&](const Cell& cell) {
    return config_.torque_units == 0 ? 0 : static_cast<double>(cell.get()) / config_.torque_units;
  };
  const double force_offset = force(torque_offset_);
  if (mode_now_ == mode_number(Cia402Mode::kCyclicPosition))
    return {Loop::kPosition, speed(velocity_offset_), force_offset};
  if (mode_now_ == mode_number(Cia402Mode::kCyclicVelocity))
    return {Loop::kVelocity, speed(target_velocity_) + speed(velocity_offset_), force_offset};
  if (mode_now_ == mode_number(Cia402Mode::kCyclicTorque))
    return {Loop::kTorque, 0, force(target_torque_) + force_offset};
  return {};
}

// A drive that counts in 32 bits has no more of a target: it goes the shorter way round to it.
double EmulatedDrive::place_of(std::int64_t counts) const {
  const std::int64_t here = std::llround(q_target_ * config_.counts_per_unit);
  const auto way = static_cast<std::int32_t>(static_cast<std::uint32_t>(counts - here));
  return counts_to_unit(static_cast<double>(here + way));
}

double EmulatedDrive::target() {
  if (mode_now_ == mode_number(Cia402Mode::kCyclicPosition)) return cyclic_target();
  // Cyclic velocity: the speed is added up from the last target, as the loop in a drive does.
  if (mode_now_ == mode_number(Cia402Mode::kCyclicVelocity))
    return q_target_ +
           counts_to_unit(static_cast<double>(target_velocity_.get()) * config_.units.counts_s(store_)) *
               config_.period_s;
  // Interpolation runs only while bit 4 enables it; else the drive holds its last target.
  if (mode_now_ == mode_number(Cia402Mode::kInterpolatedPosition) && (control_.get() & controlword::kBit4))
    return place_of(interpolation_.get());
  if (mode_now_ == mode_number(Cia402Mode::kProfilePosition)) return profile_target();
  return q_target_;
}

// A straight line to the last target, over the time until the next one
double EmulatedDrive::cyclic_target() {
  const double goal = place_of(target_position_.get());
  // A new target begins a new line. One that comes again lets the line run out.
  if (goal != cyclic_goal_) steps_left_ = interpolation_steps();
  cyclic_goal_ = goal;
  if (steps_left_ <= 1) return goal;
  return q_target_ + (goal - q_target_) / steps_left_--;
}

// 0x60C2: value * 10^exponent s between two targets, in periods of the drive's own clock
int EmulatedDrive::interpolation_steps() const {
  const std::int64_t value = store_.integer({0x60C2, 1});
  if (value <= 0) return config_.interpolation_steps;
  const double time_s =
      static_cast<double>(value) * std::pow(10.0, static_cast<double>(store_.integer({0x60C2, 2})));
  return std::max(1, static_cast<int>(std::lround(time_s / config_.period_s)));
}

// Profile position, one setpoint at a time (CiA 402-2, 9.2): a trapezoid towards the last accepted target
double EmulatedDrive::profile_target() {
  const bool rising = (control_.get() & ~control_before_) & controlword::kBit4;
  if (rising) profile_goal_ = place_of(target_position_.get());
  acknowledge_ = control_.get() & controlword::kBit4;
  const double scale = std::abs(config_.counts_per_unit), dt = config_.period_s;
  const double a = std::max(1.0, static_cast<double>(store_.integer({0x6083, 0}))) *
                   config_.units.counts_s2(store_) / scale;
  const double v_max = std::max(1.0, static_cast<double>(store_.integer({0x6081, 0}))) *
                       config_.units.counts_s(store_) / scale;
  const double way = profile_goal_ - q_target_;
  // The speed from which the way that is left is just enough to stop: v^2 = 2 a s.
  const double v_wanted = std::copysign(std::min(v_max, std::sqrt(2 * a * std::abs(way))), way);
  profile_speed_ += std::clamp(v_wanted - profile_speed_, -a * dt, a * dt);
  const double step = profile_speed_ * dt;
  return std::abs(way) <= std::abs(step) ? profile_goal_ : q_target_ + step;
}

EmulatedHoming::Switches EmulatedDrive::switches(int method) const {
  const SimulatedJoint::Config& joint = config_.joint;
  const bool reverse = config_.counts_per_unit < 0;
  EmulatedHoming::Switches out =
      config_.switches ? *config_.switches
                       : EmulatedHoming::at_home(method, reverse, joint.home + joint.index_distance,
                                                 joint.index_distance, kSwitchWidth);
  out.limit_low = joint.switch_min;
  out.limit_high = joint.switch_max;
  return out;
}

void EmulatedDrive::begin_homing(std::uint16_t control) {
  if (mode_now_ != mode_number(Cia402Mode::kHoming)) return;
  const bool rising = (control & ~control_before_) & controlword::kBit4;
  if (!rising || homing_.running()) return;
  attained_ = homing_error_ = false;
  const auto method = static_cast<int>(store_.integer({0x6098, 0}));
  if (!EmulatedHoming::knows(method)) {
    homing_error_ = true;
    return;
  }
  const double scale = std::abs(config_.counts_per_unit);
  const auto told = [&](ObjectKey key, double units, double otherwise) {
    const std::int64_t value = store_.integer(key);
    return value > 0 ? static_cast<double>(value) * units / scale : otherwise;
  };
  const double counts_s = config_.units.counts_s(store_);
  const EmulatedHoming::Run run{method, config_.counts_per_unit < 0,
                                told({0x6099, 1}, counts_s, config_.joint.speed_search),
                                told({0x6099, 2}, counts_s, config_.joint.speed_index)};
  homing_acceleration_ =
      told({0x609A, 0}, config_.units.counts_s2(store_), config_.joint.acceleration_homing);
  joint_.begin_homing();
  homing_.begin(run, switches(method), joint_.true_place());
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

std::int64_t EmulatedDrive::with_sign(std::int64_t bits) const {
  const std::int64_t bit = std::int64_t{1} << config_.sto.bit;
  return sto_ == config_.sto.when_on ? bits | bit : bits & ~bit;
}

void EmulatedDrive::report() {
  std::uint16_t status = cia402_status_bits(state_) | statusword::kRemote | statusword::kVoltage;
  if (state_ == Cia402State::kSwitchOnDisabled) status &= static_cast<std::uint16_t>(~0x20);
  const bool homing_mode = mode_now_ == mode_number(Cia402Mode::kHoming);
  const bool enabled = state_ == Cia402State::kOperationEnabled;
  if (homing_mode) {
    if (attained_ && !homing_.running()) status |= statusword::kBit12;
    if (attained_ && !homing_.running() && config_.habits.homing_reached)
      status |= statusword::kTargetReached;
    if (homing_error_) status |= statusword::kBit13;
  } else if (mode_now_ == mode_number(Cia402Mode::kProfilePosition)) {
    if (acknowledge_) status |= statusword::kBit12;
    if (q_target_ == profile_goal_) status |= statusword::kTargetReached;
  } else if (enabled && config_.habits.follows_bit) {
    status |= ignores_ ? statusword::kInternalLimit : statusword::kBit12;
  }
  if (error_code_ == kFollowingErrorCode) status |= statusword::kBit13;
  if (config_.sto.known && config_.sto.in_statusword) status = static_cast<std::uint16_t>(with_sign(status));
  if (joint_.on_limit_switch()) status |= statusword::kInternalLimit;
  status_.set(status);
  mode_display_.set(mode_now_);
  const double q = joint_.measured();
  if (joint_.has_mechanism()) torque_.set(std::llround(joint_.force() * config_.torque_units));
  position_.set(std::llround(q * config_.counts_per_unit));
  velocity_.set(std::llround((q - q_before_) / config_.period_s * config_.counts_per_unit /
                             config_.units.counts_s(store_)));
  // Limit switches are named by the drive's own direction, which is the other way round on a reversed axis.
  const bool positive = switch_bit(true) == 2 ? q > 0 : q < 0;
  const std::int64_t touch = contact_ ? std::int64_t{1} << config_.touch_input_bit : 0;
  std::int64_t inputs = (joint_.on_limit_switch() ? (positive ? 2 : 1) : 0) | touch | inputs_on_;
  if (config_.sto.known && !config_.sto.in_statusword) inputs = with_sign(inputs);
  inputs_.set(inputs);
}

}  // namespace trn
