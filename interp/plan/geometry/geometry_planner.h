#pragma once

#include <optional>

#include "core/axes.h"
#include "core/motion.h"
#include "interp/move.h"
#include "interp/plan/geometry/compressor.h"
#include "interp/plan/geometry/corner_blender.h"
#include "interp/plan/geometry/residual_moves.h"
#include "interp/plan/stages.h"

namespace trn {

struct GeometryOptions {
  bool compress = true;  ///< fit curves to runs of tiny moves; false: blend every corner
};

/// First stage of the planner: programmed moves in, a path with three continuous derivatives out, stops where
/// they must be. In exact modes the path is the programmed one; in continuous mode it leaves it within the
/// tolerances. Streams: what comes out depends on the program and on a bounded number of moves ahead only.
///
/// A stop is planned at: an event; a change of context or path mode; every end in kExactStop; every junction
/// that is not smooth in kExactPath; in kContinuous a turn of more than 175 degrees (in the path norm) and a
/// corner for which the tolerance allows no blend (zero tolerance).
class GeometryPlanner : public MoveSink, private JoinedSink {
 public:
  GeometryPlanner(const GeometryOptions& options, PieceSink& sink);

  /// Throws ProgramError when the move does not start where the last one ended, or is not finite.
  void move(const ProgramMove& move) override;
  void event(const QueueEvent& event, SourceLine source) override;

  /// All that was received goes out; the path ends in a stop.
  void finish();

 private:
  void joined(const JoinedMove& move) override;
  Words start_of(const ProgramMove& move) const;

  GeometryOptions options_;
  PieceSink& sink_;
  CornerBlender blender_;
  Compressor compressor_;
  ResidualMoves residuals_;
  std::optional<Words> end_;  ///< of the last move, in the frame of context_
  MapContext context_;
  OutputChanges outputs_;  ///< of moves that vanished
  bool at_rest_ = true;    ///< no move since the last event
};

}  // namespace trn
