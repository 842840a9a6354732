#pragma once

#include "core/fault.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "kernel/rt_messages.h"
#include "kernel/tap_gear.h"

namespace trn {

inline bool seeks_contact(ProbeMode mode) TRN_RT {
  return mode == ProbeMode::kContact || mode == ProbeMode::kTryContact;
}

/// The tick's side of inputs and outputs: what it tells the devices, and what the program waits for. Without
/// devices every input is 0 and the spindle is always ready.
class TickIo {
 public:
  /// What has become of an event.
  enum class Outcome : unsigned char { kDone, kWaits, kFailed };

  TickIo(MachineIo* io, double period_s, double spindle_timeout_s)
      : io_(io), period_s_(period_s), spindle_timeout_s_(spindle_timeout_s), tap_(period_s) {}

  /// Once a period, behind the drives' exchange; returns the devices' fault. `drives_touch`: contact of a
  /// probe on the drives' own inputs.
  /// `held`: outputs that only the drives switch.
  Fault exchange(const IoPlace& place, double spindle_override, bool drives_touch,
                 const HeldOutputs& held = {}) TRN_RT;
  /// Inputs that follow a signal of the machine's wiring, from the next exchange on.
  void overlay_inputs(const HeldOutputs& inputs) TRN_RT { wired_inputs_ = inputs; }
  /// The event in front, once a period until it is done. kFailed: `failure` says why.
  Outcome obey(const QueueEvent& event) TRN_RT;
  /// Outputs that change with the motion.
  void apply(const OutputChanges& changes) TRN_RT;
  /// The devices stand still, whatever the program tells them.
  void set_lock(bool on) TRN_RT { locked_ = on; }
  /// While the program is held: what the operator's command switches.
  void switch_by_hand(const RtCommand& command) TRN_RT;
  /// The outputs are as they were.
  void give_back(const IoOutputs& outputs) TRN_RT { outputs_ = outputs; }
  /// The motion was broken off: spindle, coolant and all outputs off, nothing is waited for.
  void all_off() TRN_RT;

  /// Value of the input that was waited for, -1: not in time.
  double input_value() const TRN_RT { return input_value_; }
  Fault failure() const TRN_RT { return failure_; }
  bool probes() const TRN_RT { return probing_; }
  /// The probe has changed as the probe move wants it.
  bool probe_found() const TRN_RT { return probing_ && inputs_.probe == seeks_contact(mode_); }
  /// The probe move is over; a move that must find something and has not is a failure.
  Outcome end_probe(bool found) TRN_RT;

  /// Between kGearStart and kGearEnd: plan time follows the spindle's turns.
  bool geared() const TRN_RT { return geared_ || tap_.active(); }
  /// And the spindle the path: its speed is nobody else's.
  bool taps() const TRN_RT { return tap_.active(); }
  /// Where the path has the tip in this period: the depth of a tap, the speed by G96.
  void follow_tip(const Vec3& tip) TRN_RT;
  /// What the spindle is told at this override; + clockwise.
  double told_rpm(double spindle_override) const TRN_RT;
  /// The rate of plan time that keeps the path with the spindle; `passed_s` and `passed_mm`: plan time and
  /// tip path of the last period.
  double gear_rate(double passed_s, double passed_mm) TRN_RT;
  /// How far the path is behind the spindle, s of plan time.
  double gear_lag_s() const TRN_RT { return gear_lag_s_; }
  /// The encoder decides what happens.
  bool reads_encoder() const TRN_RT { return geared() || awaits_index_; }

  const IoInputs& inputs() const TRN_RT { return inputs_; }
  const IoOutputs& outputs() const TRN_RT { return outputs_; }

 private:
  Outcome wait_input(const QueueEvent& event) TRN_RT;
  Outcome wait_tool(int confirm) TRN_RT;
  bool sees(std::size_t input, InputWait wait) TRN_RT;
  Outcome wait_spindle() TRN_RT;
  Outcome begin_probe(ProbeMode mode) TRN_RT;
  Outcome await_index(const QueueEvent& event) TRN_RT;
  Outcome begin_tap(const QueueEvent& event) TRN_RT;
  Outcome settle_tap(bool ends) TRN_RT;
  double turns() const TRN_RT {
    return outputs_.spindle_rpm < 0 ? -inputs_.spindle_turns : inputs_.spindle_turns;
  }
  Outcome fail(Fault fault) TRN_RT;
  bool first_look() const TRN_RT { return looks_ == 0; }

  MachineIo* io_;
  double period_s_, spindle_timeout_s_;
  IoOutputs outputs_;
  SurfaceSpeed surface_;
  IoInputs inputs_;
  HeldOutputs wired_inputs_;
  std::uint64_t looks_ = 0;  ///< periods that the event in front has waited
  std::uint64_t seen_ = 0;   ///< the inputs at the last look
  double input_value_ = 0;
  Fault failure_ = Fault::kOk;
  bool probing_ = false, locked_ = false;
  ProbeMode mode_ = ProbeMode::kContact;
  bool geared_ = false, awaits_index_ = false;
  double turns_before_ = 0;  ///< at the last look
  double gear_turns_ = 0;    ///< of the index pulse at which the path began
  double gear_turns_s_ = 1;  ///< that the plan was made for
  double gear_per_turn_mm_ = 1;
  double gear_path_turns_ = 0;  ///< where the path is, in turns of the spindle that it stands for
  double gear_lag_s_ = 0;
  TapGear tap_;
};

}  // namespace trn
