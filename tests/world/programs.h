#pragma once

#include <random>
#include <string>

namespace trn::world {

/// What of the machine a program may use.
struct Means {
  bool devices = false;  ///< spindle, probe, outputs
  bool rotary = false;   ///< axes A and C
};

/// A program for a mill: lines, arcs, dwells, program stops, offsets that no motion uses, probe
/// moves, short moves that become curves. Legal, for the most part.
std::string draw_program(std::mt19937_64& random, const Means& means);

/// A line of it for MDI.
std::string draw_line(std::mt19937_64& random, const Means& means);

}  // namespace trn::world
