#pragma once

#include <string>
#include <vector>

#include "core/machine.h"
#include "kernel/signal_wires.h"

namespace trn {

/// A [[signal]] as a person named it.
struct NamedWire {
  std::string name;
  SignalWires::Wire wire;
  double debounce_s = 0, delay_s = 0;
};

/// The tables [[signal]]; none without one. Each end is somebody's alone. ConfigError with file, line and
/// column.
std::vector<NamedWire> read_signals(const Machine& machine);

}  // namespace trn
