#pragma once

#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"
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
  double tolerance_used = 0;  ///< share of the tolerances that the piece itself uses; its blends get the rest
  bool joins_next = false;    ///< the next item continues this one with three derivatives, by construction
  SourceLine source;          ///< where it starts
  SourceLine last_source;     ///< where it ends: a curve stands for many moves
  OutputChanges outputs;      ///< act where it starts: in the middle of the blend, if there is one
};

/// The item with the tolerances that are left to its blends.
inline PathItem blend_ready(PathItem item) {
  item.tolerance_mm *= 1 - item.tolerance_used;
  item.tolerance_rad *= 1 - item.tolerance_used;
  item.tolerance_used = 0;
  return item;
}

/// Scalar product of two changes of the words, in squared units of the path parameter (see path_norm).
inline double path_dot(const Words& a, const Words& b) {
  return a.head<3>().dot(b.head<3>()) + kMmPerRadInPath * kMmPerRadInPath * a.tail<3>().dot(b.tail<3>());
}

}  // namespace trn
