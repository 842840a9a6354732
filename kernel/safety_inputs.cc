#include "kernel/safety_inputs.h"

#include "core/check.h"

namespace trn {

SafetyInputs::SafetyInputs(const std::vector<Input>& inputs) {
  for (const Input& input : inputs) inputs_.push_back({input});
}

Fault SafetyInputs::fault_of(SafetyKind kind) TRN_RT {
  switch (kind) {
    case SafetyKind::kEmergencyStop:
      return Fault::kEmergencyInput;
    case SafetyKind::kEnable:
      return Fault::kEnableOff;
    case SafetyKind::kDoor:
      return Fault::kDoorOpen;
    case SafetyKind::kAir:
    case SafetyKind::kCount:
      break;
  }
  return Fault::kAirPressure;
}

bool SafetyInputs::is_watched(const Input& input, DriveState drives, const Motion& motion) TRN_RT {
  switch (input.kind) {
    case SafetyKind::kEmergencyStop:
    case SafetyKind::kEnable:
      return drives != DriveState::kOff;
    case SafetyKind::kDoor:
      return (motion.moves && (!motion.jogs || input.stops_jogs)) || motion.spindle_turns;
    case SafetyKind::kAir:
    case SafetyKind::kCount:
      break;
  }
  return motion.moves;
}

bool SafetyInputs::is_on(const SignalName& name, std::uint64_t io_inputs, const Feedback& feedback) TRN_RT {
  TRN_CHECK(name.is_input());
  TRN_CHECK(!name.of_drive() || (name.joint >= 0 && name.joint < kMaxJoints));
  const std::uint64_t all =
      name.of_drive() ? feedback.inputs[static_cast<std::size_t>(name.joint)] : io_inputs;
  return all >> name.number & 1u;
}

Fault SafetyInputs::step(std::uint64_t io_inputs, const Feedback& feedback, const Motion& motion) TRN_RT {
  Fault fault = Fault::kOk;
  for (Watched& watched : inputs_) {
    const SignalName& from = watched.input.from;
    if (from.of_drive() && !(feedback.inputs_heard_mask >> from.joint & 1u)) continue;
    const bool safe = is_on(watched.input.from, io_inputs, feedback) == watched.input.safe_when_on;
    watched.other = safe != watched.safe ? watched.other + 1 : 0;
    if (watched.other > watched.input.debounce_periods) {
      watched.safe = safe;
      watched.other = 0;
    }
    if (!watched.safe && is_watched(watched.input, feedback.state, motion))
      fault = worse(fault, fault_of(watched.input.kind));
  }
  return fault;
}

}  // namespace trn
