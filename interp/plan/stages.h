#pragma once

#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/move.h"

// What the stages of the planner hand to each other:
//   ProgramMove -> [geometry: compression, corner blends] -> PlanPiece -> [speed] -> MotionBlock -> ring
namespace trn {

/// One piece of the path that will really be driven. Pieces of a stretch join with continuous value and three
/// derivatives by s; between stretches the machine stops.
struct PlanPiece {
  PathPiece piece;
  MapContext context;
  FeedLimit feed;
  bool rapid = false;
  bool ends_stretch = false;  ///< the machine comes to rest at the end of this piece
  SourceLine source;
  OutputChanges outputs;  ///< act where the piece begins
};

/// Receives the planned path in order; an event comes only after a piece that ends a stretch.
class PieceSink {
 public:
  virtual ~PieceSink() = default;
  virtual void piece(const PlanPiece& piece) = 0;
  virtual void event(const QueueEvent& event, SourceLine source) = 0;
};

/// Receives finished blocks in order.
class BlockSink {
 public:
  virtual ~BlockSink() = default;
  virtual void block(const MotionBlock& block) = 0;
};

}  // namespace trn
