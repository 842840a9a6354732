#pragma once

#include <random>
#include <string>

namespace trn::world {

/// A program for configs/mill.toml: lines, arcs, dwells, program stops, offsets that no motion uses, probe
/// moves, short moves that become curves. Legal, for the most part.
std::string draw_program(std::mt19937_64& random);

/// A line of it for MDI.
std::string draw_line(std::mt19937_64& random);

}  // namespace trn::world
