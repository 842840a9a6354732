#pragma once

#include <cstddef>
#include <cstdint>

namespace trn {

/// How the speed stage works; constant.
struct SpeedOptions {
  /// Shares of the joints' limits that a plan uses. The rest lets override and hold act in the tick.
  double acceleration_share = 0.99, jerk_share = 0.98;
  double window_s = 0;        ///< motion planned at once; 0: from the joints' limits
  double node_spacing_s = 0;  ///< of the grid, in estimated time; 0: from the joints' limits
  std::size_t buffered_pieces_max = 20000;
  /// Rounds of solving a window and judging its plan, at least 1. A window that has no plan by then is driven
  /// more slowly, and stops if need be.
  int rounds_max = 10;
};

/// What the stage did.
struct SpeedStats {
  std::uint64_t pieces = 0, intervals = 0, windows = 0, iterations = 0, rounds = 0;
  std::uint64_t blocks = 0;     ///< MotionBlocks emitted
  std::uint64_t slowed = 0;     ///< windows from rest that had to be slowed down as a whole
  std::uint64_t fallbacks = 0;  ///< stops inside a stretch because a window found no better plan
  double time_s = 0;            ///< of the motion emitted
};

}  // namespace trn
