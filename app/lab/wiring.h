#pragma once

#include <string>
#include <vector>

#include "app/session/assembly.h"

namespace trn {

/// One line of a machine's wiring, as people read it.
struct WireRow {
  enum class Kind { kSignal, kSafety, kBrake, kFieldBus, kSimulated };
  Kind kind = Kind::kSignal;
  std::string name;  ///< of the signal, or what it is
  std::string from, to;
  std::string how;  ///< "inverted, 20 ms debounce"; "" if it follows as it is
};

/// Signals, safety inputs, brakes, values of a field bus, and what the simulation wires, in this order.
std::vector<WireRow> wiring_of(const Assembly& assembly);

/// A drawing: sources on the left, ends on the right. An SVG document.
std::string wiring_svg(const std::string& machine, const std::vector<WireRow>& rows);

}  // namespace trn
