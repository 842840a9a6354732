#include "core/fault.h"
#include "core/ports.h"
#include "core/signal_name.h"
#include "kernel/cycle.h"
#include "kernel/rt_messages.h"
#include "kernel/signal_wires.h"

// What is wired to the machine: safety inputs and signals.
namespace trn {

// At a program stop it stands, but for what the operator moves there.
bool Cycle::may_move() const TRN_RT {
  const bool stands = motion_ == MotionState::kRest || motion_ == MotionState::kPaused;
  return !stands || detour_.moves() || retrace_.moves();
}

void Cycle::watch_safety() TRN_RT {
  if (safety_.empty()) return;
  const bool jogs = motion_ == MotionState::kJogging || detour_.moves();
  const bool turns = io_.outputs().spindle_rpm != 0;
  const Fault fault = safety_.step(io_.inputs().digital, feedback_, {may_move(), jogs, turns});
  if (fault != Fault::kOk) latch(fault, -1);
}

std::uint32_t Cycle::machine_signals() const TRN_RT {
  const auto bit = [](bool on, MachineSignal signal)
                       TRN_RT { return on ? 1u << static_cast<unsigned>(signal) : 0u; };
  const unsigned all = (1u << config_.joints.size()) - 1;
  const bool program =
      motion_ == MotionState::kMoving || motion_ == MotionState::kHeld || motion_ == MotionState::kPaused;
  const IoOutputs& told = io_.outputs();
  return bit(feedback_.state == DriveState::kEnabled, MachineSignal::kEnabled) |
         bit(may_move(), MachineSignal::kMoving) | bit(program, MachineSignal::kRunning) |
         bit(latched_.fault != Fault::kOk, MachineSignal::kFault) |
         bit((feedback_.homed_mask & all) == all, MachineSignal::kHomed) |
         bit(told.spindle_rpm != 0, MachineSignal::kSpindle) | bit(told.coolant & 1, MachineSignal::kMist) |
         bit(told.coolant & 2, MachineSignal::kFlood);
}

// What they end at acts in the next period.
void Cycle::follow_wires() TRN_RT {
  if (wires_.empty()) return;
  const SignalWires::Ends& ends = wires_.step({io_.inputs().digital, &feedback_, machine_signals()});
  io_.overlay_inputs(ends.io_inputs);
  setpoints_.outputs = ends.drive_outputs;
}

}  // namespace trn
