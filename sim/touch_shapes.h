#pragma once

#include <limits>
#include <vector>

#include "core/config.h"
#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// What lies on a simulated table for a probe to touch. Lengths mm. Every shape has a frame of its own, whose
/// pose `X_MS` is given in M as it lies with every axis at zero (program coordinates without offsets).
struct TouchShapes {
  /// A hole into a plate from above, along the plate's Z; round.
  struct Bore {
    double x = 0, y = 0, radius = 0;  ///< in the plate's frame
    double bottom = -std::numeric_limits<double>::infinity();
  };
  /// A block between two corners, less its bores, which lie inside its sides.
  struct Plate {
    Pose X_MS;
    Vec3 min, max;
    std::vector<Bore> bores = {};
  };
  /// A round pin along its own Z, from its top at the frame's origin downwards.
  struct Boss {
    Pose X_MS;
    double radius = 0, height = 0;
  };
  struct Ball {
    Vec3 centre;
    double radius = 0;
  };
  std::vector<Plate> plates;
  std::vector<Boss> bosses;
  std::vector<Ball> balls;
  bool empty() const TRN_RT { return plates.empty() && bosses.empty() && balls.empty(); }
};

/// Distance from a point to the nearest surface, mm; negative inside, infinite if there is no shape. Exact
/// outside; inside, and in the air of a bore, near a surface at least.
double distance(const TouchShapes& shapes, const Vec3& p_M) TRN_RT;

/// The arrays [[plate]], [[boss]] and [[ball]] of `table`; ConfigError as ConfigTable.
TouchShapes read_touch_shapes(const ConfigTable& table);

}  // namespace trn
