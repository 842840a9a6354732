#include "kernel/tick_io.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kGearGain_s = 40;      // 1/s
constexpr double kOnThread = 0.002;     // so near the planned speed is to the pitch's
constexpr double kSurfaceStep = 0.005;  // change of the speed by G96 that is worth telling a drive
constexpr double kProbeSettle_s = 0.1;  // the joints may lag behind the end of the probe move
}  // namespace

Fault TickIo::exchange(const IoPlace& place, double spindle_override, bool drives_touch,
                       const HeldOutputs& held) TRN_RT {
  if (!io_) {
    inputs_.probe = drives_touch;
    return Fault::kOk;
  }
  const bool lost = tap_.lost(inputs_.spindle_turns);
  if (tap_.active()) outputs_.spindle_rpm = tap_.spindle_rpm(inputs_.spindle_turns);
  IoOutputs outputs = outputs_;
  outputs.spindle_rpm = told_rpm(spindle_override);
  if (locked_) outputs = IoOutputs{};
  outputs.digital = (outputs.digital & ~held.mask) | held.on;
  inputs_.probe = false;
  io_->exchange(outputs, place, inputs_);
  inputs_.probe |= drives_touch;
  inputs_.digital = (inputs_.digital & ~wired_inputs_.mask) | wired_inputs_.on;
  return lost && inputs_.fault == Fault::kOk ? Fault::kSpindle : inputs_.fault;
}

// The greatest speed of G96 is the chuck's, so the override does not go beyond it.
double TickIo::told_rpm(double spindle_override) const TRN_RT {
  TRN_CHECK(spindle_override >= 0 && spindle_override <= 2);
  const double rpm = outputs_.spindle_rpm * spindle_override;
  return surface_.acts() ? std::clamp(rpm, -surface_.rpm_max, surface_.rpm_max) : rpm;
}

// A drive on a serial line hears of no change that nobody could measure.
void TickIo::follow_tip(const Vec3& tip) TRN_RT {
  if (tap_.active()) return tap_.follow_tip(tip);
  if (!surface_.acts()) return;
  const double rpm = surface_.rpm_at(tip), told = outputs_.spindle_rpm;
  const bool most = std::abs(rpm) == surface_.rpm_max;
  if (most || std::abs(rpm - told) > kSurfaceStep * std::abs(told)) outputs_.spindle_rpm = rpm;
}

void TickIo::apply(const OutputChanges& changes) TRN_RT {
  TRN_CHECK(changes.analog_count <= OutputChanges::kAnalogMax);
  TRN_CHECK((changes.set & changes.clear) == 0);
  outputs_.digital = (outputs_.digital & ~changes.clear) | changes.set;
  for (int i = 0; i < changes.analog_count; ++i) {
    const OutputChanges::Analog& analog = changes.analog[static_cast<std::size_t>(i)];
    outputs_.analog[analog.index % kMaxIo] = analog.value;
  }
}

void TickIo::switch_by_hand(const RtCommand& command) TRN_RT {
  using Kind = RtCommand::Kind;
  const std::uint64_t bit = std::uint64_t{1} << (command.joint & (kMaxIo - 1));
  if (command.kind == Kind::kSpindle) {
    outputs_.spindle_rpm = command.value;
    outputs_.spindle_orients = false;
  }
  if (command.kind == Kind::kCoolant) outputs_.coolant = command.joint;
  if (command.kind == Kind::kDigitalOutput)
    outputs_.digital = command.value != 0 ? outputs_.digital | bit : outputs_.digital & ~bit;
}

void TickIo::all_off() TRN_RT {
  outputs_ = {};
  surface_ = {};
  looks_ = 0;
  tap_.end();
  probing_ = geared_ = awaits_index_ = false;
}

TickIo::Outcome TickIo::obey(const QueueEvent& event) TRN_RT {
  using Kind = QueueEvent::Kind;
  const std::uint64_t bit = std::uint64_t{1} << (event.argument & (kMaxIo - 1));
  switch (event.kind) {
    case Kind::kSpindle:
      outputs_.spindle_rpm = event.value;
      outputs_.spindle_orients = false;
      surface_ = event.surface;
      return event.value == 0 ? Outcome::kDone : wait_spindle();
    case Kind::kSpindleOrient:
      outputs_.spindle_rpm = 0;
      outputs_.spindle_orients = true;
      surface_ = {};
      outputs_.spindle_deg = event.value;
      return wait_spindle();
    case Kind::kCoolant:
      outputs_.coolant = event.argument;
      return Outcome::kDone;
    case Kind::kDigitalOutput:
      outputs_.digital = event.value != 0 ? outputs_.digital | bit : outputs_.digital & ~bit;
      return Outcome::kDone;
    case Kind::kAnalogOutput:
      outputs_.analog[static_cast<std::size_t>(event.argument & (kMaxIo - 1))] = event.value;
      return Outcome::kDone;
    case Kind::kWaitInput:
      return wait_input(event);
    case Kind::kToolChange:
      return wait_tool(static_cast<int>(event.value));
    case Kind::kGearStart:
      return event.argument == static_cast<std::int32_t>(GearMode::kPathLeads) ? begin_tap(event)
                                                                               : await_index(event);
    case Kind::kGearReverse:
      return settle_tap(false);
    case Kind::kGearEnd:
      if (tap_.active()) return settle_tap(true);
      geared_ = false;
      return Outcome::kDone;
    case Kind::kProbeStart:
      return begin_probe(static_cast<ProbeMode>(event.argument));
    case Kind::kProgramEnd:
      if (event.argument == 1) outputs_.coolant = 0;
      return Outcome::kDone;
    case Kind::kProbeEnd:
      return static_cast<double>(looks_++) * period_s_ < kProbeSettle_s ? Outcome::kWaits : end_probe(false);
    default:
      return Outcome::kDone;
  }
}

// The devices hear of the command at the end of this period, and answer in the next.
TickIo::Outcome TickIo::wait_spindle() TRN_RT {
  if (!io_) return Outcome::kDone;
  if (looks_++ < 1) return Outcome::kWaits;
  if (!inputs_.spindle_ready) {
    if (static_cast<double>(looks_) * period_s_ > spindle_timeout_s_) return fail(Fault::kSpindle);
    return Outcome::kWaits;
  }
  looks_ = 0;
  return Outcome::kDone;
}

// Every pass of a thread begins at the index pulse, so that all meet the same groove. A session's log has the
// encoder from the first look on, so that only later ones may compare.
TickIo::Outcome TickIo::await_index(const QueueEvent& event) TRN_RT {
  const double now = turns(), index = std::floor(now);
  const bool passed = looks_ >= 2 && index > std::floor(turns_before_);
  turns_before_ = now;
  awaits_index_ = !passed;
  if (!passed) {
    if (static_cast<double>(++looks_) * period_s_ > spindle_timeout_s_) return fail(Fault::kSpindle);
    return Outcome::kWaits;
  }
  looks_ = 0;
  geared_ = true;
  gear_turns_ = index;
  gear_turns_s_ = event.value;
  TRN_CHECK(event.value != 0 && event.per_turn_mm > 0);
  gear_per_turn_mm_ = event.per_turn_mm;
  gear_path_turns_ = gear_lag_s_ = 0;
  return Outcome::kDone;
}

// The log's encoder, as for a thread.
TickIo::Outcome TickIo::begin_tap(const QueueEvent& event) TRN_RT {
  awaits_index_ = looks_ < 2;
  if (looks_++ < 2) return Outcome::kWaits;
  looks_ = 0;
  outputs_.spindle_orients = false;
  surface_ = {};
  tap_.begin(inputs_.spindle_turns, event.value, event.per_turn_mm);
  return Outcome::kDone;
}

TickIo::Outcome TickIo::settle_tap(bool ends) TRN_RT {
  if (!tap_.settled(inputs_.spindle_turns)) {
    if (static_cast<double>(++looks_) * period_s_ > spindle_timeout_s_) return fail(Fault::kSpindle);
    return Outcome::kWaits;
  }
  looks_ = 0;
  if (ends) tap_.end();
  return Outcome::kDone;
}

// On the thread itself the tip's own path says which turn it stands for: the planned speed lies a little
// below the one asked for, and plan time alone would make the pitch as much too short. In the run-in and the
// run-out it is plan time, the same in every pass.
double TickIo::gear_rate(double passed_s, double passed_mm) TRN_RT {
  if (tap_.active()) return tap_.rate(inputs_.spindle_turns);
  TRN_CHECK(geared_ && gear_turns_s_ != 0);
  const double now = turns(), speed = (now - turns_before_) / period_s_ / gear_turns_s_;
  turns_before_ = now;
  const double by_time = passed_s * gear_turns_s_, by_path = passed_mm / gear_per_turn_mm_;
  gear_path_turns_ += std::abs(by_path - by_time) < kOnThread * by_time ? by_path : by_time;
  gear_lag_s_ = (now - gear_turns_ - gear_path_turns_) / gear_turns_s_;
  return std::max(0.0, speed + kGearGain_s * gear_lag_s_);
}

bool TickIo::sees(std::size_t input, InputWait wait) TRN_RT {
  const bool now = (inputs_.digital >> input & 1) != 0;
  const bool before = first_look() ? now : (seen_ >> input & 1) != 0;
  seen_ = inputs_.digital;
  return wait == InputWait::kNow || (wait == InputWait::kRise && now && !before) ||
         (wait == InputWait::kFall && !now && before) || (wait == InputWait::kHigh && now) ||
         (wait == InputWait::kLow && !now);
}

// Only a rise tells of a hand: an input that is on already may be stuck. As long as it takes.
TickIo::Outcome TickIo::wait_tool(int confirm) TRN_RT {
  if (confirm < 0) return Outcome::kDone;
  const bool in = sees(static_cast<std::size_t>(confirm % kMaxIo), InputWait::kRise);
  looks_ = in ? 0 : looks_ + 1;
  return in ? Outcome::kDone : Outcome::kWaits;
}

TickIo::Outcome TickIo::wait_input(const QueueEvent& event) TRN_RT {
  const InputArgument input = InputArgument::unpack(event.argument);
  const auto index = static_cast<std::size_t>(input.index % kMaxIo);
  const bool now = (inputs_.digital >> index & 1) != 0;
  const bool met = sees(index, input.wait);
  const bool late = static_cast<double>(looks_) * period_s_ >= event.value;
  if (!met && !late) {
    ++looks_;
    return Outcome::kWaits;
  }
  input_value_ = !met ? -1.0 : input.analog ? inputs_.analog[index] : now ? 1.0 : 0.0;
  looks_ = 0;
  return Outcome::kDone;
}

TickIo::Outcome TickIo::begin_probe(ProbeMode mode) TRN_RT {
  mode_ = mode;
  probing_ = true;
  return probe_found() ? fail(Fault::kProbe) : Outcome::kDone;
}

TickIo::Outcome TickIo::end_probe(bool found) TRN_RT {
  TRN_CHECK(probing_);
  probing_ = false;
  looks_ = 0;
  const bool must = mode_ == ProbeMode::kContact || mode_ == ProbeMode::kRelease;
  return must && !found ? fail(Fault::kProbe) : Outcome::kDone;
}

TickIo::Outcome TickIo::fail(Fault fault) TRN_RT {
  TRN_CHECK(fault != Fault::kOk);
  failure_ = fault;
  looks_ = 0;
  tap_.end();
  probing_ = geared_ = awaits_index_ = false;
  return Outcome::kFailed;
}

}  // namespace trn
