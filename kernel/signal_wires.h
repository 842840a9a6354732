#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/axes.h"
#include "core/ports.h"
#include "core/realtime.h"
#include "core/signal_name.h"

namespace trn {

/// The machine's wiring in the tick, section [[signal]]: outputs and program inputs that follow inputs and
/// states of the machine, with debounce, inversion and delay. No logic: what needs it talks to the daemon.
class SignalWires {
 public:
  struct Wire {
    SignalName from, to;
    bool invert = false;
    std::uint32_t debounce_periods = 0;  ///< a change counts when it has lasted for longer
    std::uint32_t delay_periods = 0;     ///< on comes so much later, off at once
  };
  /// What wires may begin at, by the end of a period.
  struct Sources {
    std::uint64_t io_inputs = 0;
    const Feedback* feedback = nullptr;
    std::uint32_t machine = 0;  ///< bit i: MachineSignal i
  };
  /// What they end at.
  struct Ends {
    HeldOutputs io_outputs, io_inputs;
    std::array<std::uint32_t, kMaxJoints> drive_outputs{};
  };

  explicit SignalWires(const std::vector<Wire>& wires);
  bool empty() const TRN_RT { return wires_.empty(); }

  /// Once a period.
  const Ends& step(const Sources& sources) TRN_RT;
  const Ends& ends() const TRN_RT { return ends_; }

 private:
  struct Live {
    Wire wire;
    bool steady = false;      ///< the source, debounced
    std::uint32_t other = 0;  ///< periods for which it has looked otherwise
    std::uint32_t on = 0;     ///< periods for which the wire has wanted to be on
    bool started = false;
  };
  static bool reads(const SignalName& from, const Sources& sources) TRN_RT;
  static bool follow(Live& live, bool now) TRN_RT;
  void put(const SignalName& to, bool on) TRN_RT;

  std::vector<Live> wires_;
  Ends ends_;
};

}  // namespace trn
