#include "hal/can/cia402_axis.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.h"

namespace trn {

namespace {
constexpr std::uint32_t kStaleStatusPeriods = 5;  // until the status word can know of a command
constexpr std::uint32_t kSettledPeriods = 20;     // in its mode, until bit 12 is of this mode
constexpr std::uint32_t kIgnoredMax = 5;          // in which the drive may not follow
constexpr std::uint32_t kStandingPeriods = 10;    // at one place within a count: it stands
constexpr int kImplausibleMax = 3;                // after so many, it is the position after all, and a fault

bool powered(Cia402State state) TRN_RT {
  return state == Cia402State::kOperationEnabled || state == Cia402State::kQuickStopActive;
}
}  // namespace

bool Cia402Axis::stands() const TRN_RT { return standing_periods_ >= kStandingPeriods; }

void Cia402Axis::enable() TRN_RT {
  // A wish that stands already keeps its count of periods: an enable that is repeated every period must still
  // run out of time.
  const bool stops = wish_ == Wish::kStop;
  if (stops ? again_ : wish_ == Wish::kEnabled) return;
  periods_ = 0;
  // A drive that brakes would lose its torque on the way from Quick Stop Active, and one that has not yet
  // obeyed still looks enabled.
  again_ = stops;
  if (stops) return;
  was_enabled_ = false;
  wish_ = Wish::kEnabled;
}

void Cia402Axis::disable() TRN_RT {
  wish_ = Wish::kOff;
  again_ = false;
}

void Cia402Axis::end_stop() TRN_RT {
  TRN_CHECK(wish_ == Wish::kStop);
  wish_ = Wish::kOff;
  if (std::exchange(again_, false)) enable();
}

void Cia402Axis::quick_stop() TRN_RT {
  // A drive that is off or on its way there has nothing to stop, and must not be led back to Quick Stop
  // Active.
  if (wish_ == Wish::kEnabled) wish_ = Wish::kStop;
  again_ = false;
  homing_ = Homing::kNone;
}

void Cia402Axis::home() TRN_RT {
  // An absolute encoder knows where it is. A homing run would only lose it.
  if (state_ != DriveState::kEnabled || config_.absolute) return;
  homing_ = Homing::kMode;
  homed_ = false;
  periods_ = 0;
}

void Cia402Axis::reset() TRN_RT {
  fault_ = Fault::kOk;
  reset_wish_ = true;
  reset_edge_ = false;
  implausible_ = 0;
  periods_ = 0;
}

void Cia402Axis::fail(Fault fault) TRN_RT {
  TRN_CHECK(fault != Fault::kOk);
  // The first fault is kept: what follows, such as a drive that drops out after a following error, is most
  // often its consequence.
  if (fault_ == Fault::kOk) fault_ = fault;
  if (fault_info(fault).reaction == Reaction::kQuickStop) quick_stop();
}

// To the nearest count. Cutting off would shift every position towards zero, by half a count on the mean.
std::int32_t Cia402Axis::saturated(double counts) TRN_RT {
  constexpr double kMax = 2147483647.0;
  TRN_CHECK(std::isfinite(counts));
  return static_cast<std::int32_t>(std::clamp(std::nearbyint(counts), -kMax, kMax));
}

std::int32_t Cia402Axis::counts(double q) const TRN_RT {
  const double counts = (q - config_.offset) * config_.counts_per_unit;
  if (!config_.endless) return saturated(counts);
  // What is above 32 bits the drive has lost as well: it goes the short way to the same count.
  TRN_CHECK(std::abs(counts) < 9e15);
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(std::llrint(counts)));
}

std::int64_t Cia402Axis::unwrapped(std::int32_t counts) const TRN_RT {
  if (!config_.endless) return counts;
  const std::uint32_t ahead = static_cast<std::uint32_t>(counts) - static_cast<std::uint32_t>(heard_counts_);
  return heard_counts_ + static_cast<std::int32_t>(ahead);
}

// A frame of somebody else may pretend anything. Of a drive that obeys setpoints, a feedback that cannot be
// is left out; of any other drive, one that does not agree with the one before.
void Cia402Axis::measure(const Input& input) TRN_RT {
  if (!input.fresh) return;
  heard_counts_ = std::exchange(forgotten_, false) ? input.position : unwrapped(input.position);
  const double q = position_of(input.position);
  const bool stands = std::abs(q - heard_) * std::abs(config_.counts_per_unit) < 1.5;
  standing_periods_ = heard_once_ && stands ? standing_periods_ + 1 : 0;
  const auto jumps_from = [&](double other) TRN_RT {
    return config_.step_max > 0 && std::abs(q - other) > config_.step_max;
  };
  // Two different judgements: `agrees_` compares with what was heard last, whether believed or not, `watched`
  // with what was believed last.
  agrees_ = heard_once_ && !jumps_from(heard_);
  heard_ = q;
  heard_once_ = true;
  // A drive that obeys cannot leap by more than its speed allows in a period. One impossible value is left
  // out. After more than three in a row the drive really is somewhere else, which is worth a fault.
  const bool watched = measured_once_ && state_ == DriveState::kEnabled;
  implausible_ = watched && jumps_from(measured_) ? implausible_ + 1 : 0;
  if (implausible_ > kImplausibleMax) {
    implausible_ = 0;
    fail(Fault::kFollowingError);
  } else if (watched ? implausible_ > 0 : !agrees_) {
    return;
  }
  measured_ = q;
  measured_counts_ = input.position;
  measured_once_ = true;
}

void Cia402Axis::step(const Input& input, double q, double qd, bool follow, Output& output) TRN_RT {
  const Cia402State drive = cia402_state(input.statusword);
  TRN_CHECK(config_.counts_per_unit != 0);
  measure(input);
  // The control word starts as 0, which is Disable Voltage: whoever sets nothing below switches the drive
  // off.
  output = Output{};
  output.mode = static_cast<std::int8_t>(config_.mode);
  if (drive == Cia402State::kFault || drive == Cia402State::kFaultReactionActive)
    step_fault(drive, output);
  else
    step_wish(drive, input, output);
  // Behind the state machine, which may have changed the state in this very period: a setpoint must not go to
  // a drive that has just dropped out.
  set_targets(input, q, qd, follow && state_ == DriveState::kEnabled, output);
  watch_following(q, follow && state_ == DriveState::kEnabled);
  watch_obedience(input, follow && state_ == DriveState::kEnabled);
}

// Bit 12 says that the drive follows its target (CiA 402-2, clauses 13 and 14). A drive that has never set it
// does not know it. One that clears it, as at a limit of its own, would go on from elsewhere later.
void Cia402Axis::watch_obedience(const Input& input, bool follow) TRN_RT {
  const bool cyclic = config_.mode == Cia402Mode::kCyclicPosition ||
                      config_.mode == Cia402Mode::kCyclicVelocity ||
                      config_.mode == Cia402Mode::kCyclicTorque;
  if (!cyclic || !config_.habits.follows_bit || state_ != DriveState::kEnabled) {
    enabled_periods_ = ignored_periods_ = 0;
    followed_once_ = false;
    return;
  }
  if (!input.fresh || ++enabled_periods_ < kSettledPeriods) return;
  const bool follows = input.statusword & statusword::kBit12;
  followed_once_ |= follows;
  ignored_periods_ = follows ? 0 : ignored_periods_ + 1;
  if (follow && followed_once_ && ignored_periods_ > kIgnoredMax) fail(Fault::kDriveIgnores);
}

bool Cia402Axis::may_switch_mode() const TRN_RT {
  return !config_.habits.stands_to_switch || standing_periods_ >= kStandingPeriods;
}

// The rising edge of bit 7 resets (CiA 402-2, 8.4.1); it is made anew until the drive obeys or time is up.
void Cia402Axis::step_fault(Cia402State drive, Output& output) TRN_RT {
  TRN_CHECK(drive == Cia402State::kFault || drive == Cia402State::kFaultReactionActive);
  state_ = DriveState::kFault;
  homing_ = Homing::kNone;
  if (reset_wish_ && ++periods_ <= config_.enable_periods_max) {
    // A drive sees an edge only if it saw the bit at 0 before, so 0 and 1 take turns. While the reaction to
    // the fault is still running a reset would be lost.
    reset_edge_ = !reset_edge_ && drive == Cia402State::kFault;
    output.controlword = reset_edge_ ? controlword::kFaultReset : 0;
    state_ = DriveState::kStarting;
    return;
  }
  reset_wish_ = false;
  disable();
  if (fault_ == Fault::kOk) fault_ = Fault::kDriveFault;
}

void Cia402Axis::step_wish(Cia402State drive, const Input& input, Output& output) TRN_RT {
  // The drive has left Fault: the reset has done its work. Status words that are not fresh still show the
  // time before it.
  if (input.fresh && drive != Cia402State::kNotReady) reset_wish_ = false;
  if (wish_ == Wish::kStop) step_stop(drive);
  if (wish_ == Wish::kStop) {
    output.controlword = controlword::kQuickStop;
    state_ = again_ ? DriveState::kStarting : DriveState::kQuickStop;
    return;
  }
  if (wish_ == Wish::kOff) {
    was_enabled_ = false;
    state_ = fault_ != Fault::kOk && fault_info(fault_).reaction == Reaction::kQuickStop ? DriveState::kFault
                                                                                         : DriveState::kOff;
    return;
  }
  // One transition a period, by what the drive shows and not by what it should have done: drives take their
  // time for each.
  output.controlword = controlword_towards_enabled(drive);
  if (drive == Cia402State::kOperationEnabled) return step_enabled(input, output);
  // It had been enabled and is not any more, without being told: an STO input, a lost supply, somebody with a
  // service tool.
  if (was_enabled_) {
    wish_ = Wish::kOff;
    state_ = DriveState::kFault;
    return fail(input.sto ? Fault::kSafeTorqueOff : Fault::kDriveDropped);
  }
  state_ = DriveState::kStarting;
  if (++periods_ <= config_.enable_periods_max) return;
  wish_ = Wish::kOff;
  fail(input.sto ? Fault::kSafeTorqueOff : Fault::kDriveNotReady);
}

// The quick stop ends in Switch On Disabled (0x605A = 2, as written at bring-up; with a brake it stays, until
// the brake holds: 6). From there only `enable` leads it on. A drive that stays without a brake is led on
// when it stands, and one that never seems to stand, because of its encoder's noise, when time is up.
void Cia402Axis::step_stop(Cia402State drive) TRN_RT {
  if (!powered(drive)) return end_stop();
  if (!again_ || config_.braked) return;
  const bool stays = drive == Cia402State::kQuickStopActive && stands();
  if (stays || ++periods_ > config_.enable_periods_max) end_stop();
}

void Cia402Axis::step_enabled(const Input& input, Output& output) TRN_RT {
  was_enabled_ = true;
  if (homing_ != Homing::kNone) return step_homing(input, output);
  const bool in_mode = input.mode == static_cast<std::int8_t>(config_.mode);
  // The mode display (0x6061) decides, not the mode that was sent: a drive takes up to some periods to change
  // it, and in the wrong mode a position would be taken for a speed.
  if (in_mode) {
    state_ = DriveState::kEnabled;
    periods_ = 0;
  } else if (state_ == DriveState::kEnabled && input.fresh) {
    fail(Fault::kDriveDropped);  // somebody else took it out of its mode
  } else if (state_ != DriveState::kEnabled) {
    state_ = DriveState::kStarting;
    if (++periods_ > config_.enable_periods_max) fail(Fault::kDriveNotReady);
  }
}

// Mode 6 (CiA 402-2, clause 11): set the mode, raise bit 4, wait for 'attained' and 'reached', go back.
void Cia402Axis::step_homing(const Input& input, Output& output) TRN_RT {
  TRN_CHECK(homing_ != Homing::kNone);
  TRN_CHECK(!config_.absolute);
  state_ = DriveState::kHoming;
  if (homing_ == Homing::kFinal) {
    if (++periods_ > config_.homing_periods_max) return fail(Fault::kHomingFailed);
    return step_final();
  }
  const bool in_homing = input.mode == static_cast<std::int8_t>(Cia402Mode::kHoming);
  if (++periods_ > config_.homing_periods_max) return fail(Fault::kHomingFailed);
  // The mode is asked for when the drive can take it; until then it keeps the one it has.
  const bool goes = homing_ == Homing::kMode && !in_homing && may_switch_mode();
  const bool stays = in_homing && (homing_ != Homing::kBack || !may_switch_mode());
  if (goes || stays) output.mode = static_cast<std::int8_t>(Cia402Mode::kHoming);
  if (homing_ == Homing::kMode && in_homing) {
    homing_ = Homing::kRun;
    periods_ = 0;
  }
  if (homing_ == Homing::kRun) {
    output.controlword |= controlword::kBit4;
    // Bits 12 and 13 of the status word may still be those of an earlier run. For some periods they say
    // nothing of this one.
    if (periods_ < kStaleStatusPeriods) return;
    if (input.statusword & statusword::kBit13) return fail(Fault::kHomingFailed);
    const bool reached = (input.statusword & statusword::kTargetReached) || !config_.habits.homing_reached;
    const bool done = (input.statusword & statusword::kBit12) && reached;
    if (done) homing_ = Homing::kBack;
  }
  const bool back = homing_ == Homing::kBack && input.mode == static_cast<std::int8_t>(config_.mode);
  // The position jumps when homing sets the zero. It is taken over when two feedbacks in a row agree on it.
  if (!back || !agrees_) return;
  heard_counts_ = input.position;           // it counts from its zero, in no other turn of its 32 bits
  measured_ = position_of(input.position);  // it has just jumped to what it is
  measured_counts_ = target_ = input.position;
  if (!std::isfinite(config_.home_final)) return end_homing();
  homing_ = Homing::kFinal;
  final_.begin(measured_);
}

void Cia402Axis::end_homing() TRN_RT {
  homing_ = Homing::kNone;
  homed_ = true;
  state_ = DriveState::kEnabled;
}

// From where homing ended to where the config wants the joint; the drive follows as it does a plan.
void Cia402Axis::step_final() TRN_RT {
  if (!final_.step(config_.home_final, {config_.final_speed, config_.final_acceleration, config_.period_s}))
    return;
  // Homing has ended when the drive is there as well, to what the encoder shows.
  const double near = std::max(1e-3, 10 / std::abs(config_.counts_per_unit));
  if (std::abs(measured_ - config_.home_final) < near) end_homing();
}

void Cia402Axis::set_targets(const Input& input, double q, double qd, bool follow, Output& output) TRN_RT {
  const bool final = homing_ == Homing::kFinal && state_ == DriveState::kHoming;
  if (final) {
    q = final_.place();
    qd = final_.speed();
    follow = true;
  }
  // Enabled but not followed: it holds the last target. Not enabled: the target goes with the measured place,
  // so that the axis does not jump to an old one when it gets power.
  const bool holds = state_ == DriveState::kEnabled && !follow;
  if (follow)
    target_ = counts(q);
  else if (!holds)
    target_ = measured_counts_;
  output.position = target_;
  set_forces(follow ? q : position_of(target_), follow, output);
  const double hold = position_of(target_);
  // In cyclic velocity mode the position loop is closed here: the plan's own speed in front, and a gain on
  // what is missing of the setpoint that the measurement belongs to.
  const double then = history_ >= 2 ? q_history_[1] : q;
  const double wanted =
      follow ? qd + config_.gain_1_s * (then - measured_) : config_.gain_1_s * (hold - measured_);
  const bool moves = state_ == DriveState::kEnabled || final;
  if (moves) output.velocity = saturated(wanted * config_.counts_per_unit * config_.velocity_units);
  if (!moves || (homing_ != Homing::kNone && !final)) return;
  if (config_.mode == Cia402Mode::kInterpolatedPosition) output.controlword |= controlword::kBit4;
  if (config_.mode == Cia402Mode::kProfilePosition) start_new_setpoint(input, output);
}

std::int16_t Cia402Axis::thousandths(double force) const TRN_RT {
  TRN_CHECK(std::isfinite(force));
  return static_cast<std::int16_t>(
      std::clamp(std::nearbyint(force * config_.torque_units), -32767.0, 32767.0));
}

// What the model says at rest, a joint's weight above all, helps a drive that holds as well.
void Cia402Axis::set_forces(double q, bool follow, Output& output) TRN_RT {
  const bool powered = state_ == DriveState::kEnabled || state_ == DriveState::kHoming;
  if (follow)
    output.velocity_offset = saturated(velocity_offset_ * config_.counts_per_unit * config_.velocity_units);
  if (powered) output.torque_offset = thousandths(force_offset_);
  if (config_.mode != Cia402Mode::kCyclicTorque) return;
  if (state_ != DriveState::kEnabled) return torque_loop_.restart(measured_);
  output.torque = thousandths(torque_loop_.step(q, measured_));
}

// Single setpoints, taken at once (CiA 402-2, 9.2.2): bit 4 up until the drive acknowledges in bit 12, then
// down.
void Cia402Axis::start_new_setpoint(const Input& input, Output& output) TRN_RT {
  output.controlword |= controlword::kChangeAtOnce;
  const bool acknowledge = input.statusword & statusword::kBit12;
  if (acknowledged_) {  // handshake over; begin one if the target is a new one
    output.position = sent_target_;
    if (acknowledge || target_ == sent_target_) return;
    sent_target_ = target_;
    acknowledged_ = false;
  }
  output.position = sent_target_;
  // Within a handshake the target stays, or the drive could take half of one setpoint and half of the next.
  if (acknowledge)
    acknowledged_ = true;
  else
    output.controlword |= controlword::kBit4;
}

// A setpoint acts with the SYNC after it and is measured with the next: two periods
void Cia402Axis::watch_following(double q, bool follow) TRN_RT {
  if (!follow) {
    history_ = 0;
    return;
  }
  // q_history_[0] is the setpoint of the period before, [1] of two before. Compared with the newest one, an
  // axis at 500 mm/s and 1 ms would seem to be 1 mm behind without any lag.
  const double error = std::abs(q_history_[1] - measured_);
  const bool watched = config_.following_error_max > 0 && history_ >= 2;
  TRN_CHECK(history_ >= 0 && history_ <= 2);
  if (watched && error > config_.following_error_max) fail(Fault::kFollowingError);
  q_history_[1] = q_history_[0];
  q_history_[0] = q;
  history_ = std::min(history_ + 1, 2);
}

}  // namespace trn
