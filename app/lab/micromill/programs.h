#pragma once

#include <string>
#include <vector>

#include "sim/micromill/part_surface.h"

// The programs of the micro-mill's experiment, as G-code. Circles at constant feed are sines on both axes.
namespace trn {

/// A program and the lines (1-based) whose motion counts.
struct LabProgram {
  std::string text;
  std::vector<std::uint32_t> lines;
};

/// Sines over the whole travel, several amplitudes and speeds, nothing cut: what the networks learn from.
LabProgram sine_program();
/// Sines of other amplitudes and speeds, and ramps across the table: what they are judged by.
LabProgram validation_program();
/// Presses the tool along an axis (0: X, 1: Y) against a block that it touches at `block_mm`, by `depth_mm`.
LabProgram pressing_program(int axis, double block_mm, double depth_mm);
/// The part's nominal diameter or width, mm (docs/sources.md S5.6).
inline constexpr double kPartSizeMm = 24.6;
inline constexpr double kToolRadiusMm = 0.5;
/// Cuts a part around the origin out of the plate, clockwise, in a slot; the lines are those of the contour.
LabProgram part_program(PartSurface::Shape shape);

}  // namespace trn
