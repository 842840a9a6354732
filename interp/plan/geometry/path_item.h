#pragma once

#include "interp/plan/stages.h"

namespace trn {

/// A programmed move (or a part of the curve fitted to many) on its way through the geometry stage.
struct PathItem {
  PathPiece piece;
  MapContext context;
  FeedLimit feed;
  bool rapid = false;
  PathMode mode = PathMode::kContinuous;
  double tolerance_mm = 0;  ///< what a blend at either end may still use
  double tolerance_rad = 0;
  double lost = 0;  ///< share of the tolerances that the piece itself may be off, to be kept from its blends
  bool joins_next = false;      ///< the next item continues this one with three derivatives, by construction
  std::uint32_t line = 0;       ///< where it starts
  std::uint32_t last_line = 0;  ///< where it ends: a curve stands for many moves
  OutputChanges outputs;        ///< act where it starts: in the middle of the blend, if there is one
};

/// With the tolerances that its blends may use.
inline PathItem blend_ready(PathItem item) {
  item.tolerance_mm *= 1 - item.lost;
  item.tolerance_rad *= 1 - item.lost;
  item.lost = 0;
  return item;
}

/// True when both contexts mean the same to the joints.
inline bool same_context(const MapContext& a, const MapContext& b) {
  return a.rtcp == b.rtcp && a.tool_offset == b.tool_offset && a.X_WB.R == b.X_WB.R && a.X_WB.p == b.X_WB.p;
}

/// Scalar product and norm whose unit is the path parameter (see path_norm).
inline double path_dot(const Words& a, const Words& b) {
  return a.head<3>().dot(b.head<3>()) + kMmPerRadInPath * kMmPerRadInPath * a.tail<3>().dot(b.tail<3>());
}

}  // namespace trn
