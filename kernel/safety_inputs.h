#pragma once

#include <cstdint>
#include <vector>

#include "core/fault.h"
#include "core/ports.h"
#include "core/realtime.h"
#include "core/signal_name.h"

namespace trn {

/// What a safety input stands for. Each has one fault, and with it one reaction (core/fault.cc).
enum class SafetyKind : std::uint8_t {
  kEmergencyStop,  ///< watched while the drives are on
  kEnable,         ///< the same
  kDoor,           ///< watched while something moves, or the spindle turns
  kAir,            ///< watched while something moves
  kCount
};

/// The machine's safety inputs in the tick: a fault when one is not safe. They tell the control; people are
/// protected by hardware (docs/safety.md).
class SafetyInputs {
 public:
  struct Input {
    SafetyKind kind = SafetyKind::kEmergencyStop;
    SignalName from;
    bool safe_when_on = true;            ///< a broken wire is not safe then
    std::uint32_t debounce_periods = 0;  ///< it counts when it has lasted for longer
    bool stops_jogs = true;              ///< of a door
  };
  struct Motion {
    bool moves = false, jogs = false, spindle_turns = false;
  };

  explicit SafetyInputs(const std::vector<Input>& inputs);
  bool empty() const TRN_RT { return inputs_.empty(); }

  /// Once a period; kOk if all is safe that is watched now.
  Fault step(std::uint64_t io_inputs, const Feedback& feedback, const Motion& motion) TRN_RT;
  static Fault fault_of(SafetyKind kind) TRN_RT;

 private:
  struct Watched {
    Input input;
    bool safe = true;
    std::uint32_t other = 0;  ///< periods for which it has looked otherwise
  };
  static bool is_watched(const Input& input, DriveState drives, const Motion& motion) TRN_RT;
  static bool is_on(const SignalName& name, std::uint64_t io_inputs, const Feedback& feedback) TRN_RT;

  std::vector<Watched> inputs_;
};

}  // namespace trn
