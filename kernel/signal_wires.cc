#include "kernel/signal_wires.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

SignalWires::SignalWires(const std::vector<Wire>& wires) {
  for (const Wire& wire : wires) wires_.push_back({wire});
}

bool SignalWires::reads(const SignalName& from, const Sources& sources) TRN_RT {
  using K = SignalName::Kind;
  TRN_CHECK(from.number >= 0 && from.number < 64);
  if (from.kind == K::kMachine) return sources.machine >> from.number & 1u;
  if (from.kind == K::kIoInput) return sources.io_inputs >> from.number & 1u;
  TRN_CHECK(from.kind == K::kDriveInput && from.joint >= 0 && from.joint < kMaxJoints);
  return sources.feedback->inputs[static_cast<std::size_t>(from.joint)] >> from.number & 1u;
}

// What the wire is at its end.
bool SignalWires::follow(Live& live, bool now) TRN_RT {
  if (!live.started) live.steady = now;
  live.started = true;
  live.other = now != live.steady ? live.other + 1 : 0;
  if (live.other > live.wire.debounce_periods) {
    live.steady = now;
    live.other = 0;
  }
  const bool wanted = live.steady != live.wire.invert;
  live.on = wanted ? std::min(live.on + 1, live.wire.delay_periods + 1) : 0;
  return live.on > live.wire.delay_periods;
}

void SignalWires::put(const SignalName& to, bool on) TRN_RT {
  using K = SignalName::Kind;
  const std::uint64_t bit = std::uint64_t{1} << to.number;
  if (to.kind == K::kDriveOutput) {
    TRN_CHECK(to.joint >= 0 && to.joint < kMaxJoints);
    std::uint32_t& bits = ends_.drive_outputs[static_cast<std::size_t>(to.joint)];
    bits = static_cast<std::uint32_t>(on ? bits | bit : bits & ~bit);
    return;
  }
  HeldOutputs& held = to.kind == K::kIoOutput ? ends_.io_outputs : ends_.io_inputs;
  held.mask |= bit;
  held.on = on ? held.on | bit : held.on & ~bit;
}

const SignalWires::Ends& SignalWires::step(const Sources& sources) TRN_RT {
  for (Live& live : wires_) put(live.wire.to, follow(live, reads(live.wire.from, sources)));
  return ends_;
}

}  // namespace trn
