#pragma once

#include <optional>

#include "core/motion.h"
#include "core/path.h"
#include "interp/plan/geometry/corner_blend.h"
#include "interp/plan/geometry/path_item.h"
#include "interp/plan/stages.h"

namespace trn {

/// Rounds the corners between items and emits the pieces. It holds two items: two blends share the item
/// between them, so the first is final only when the span that the second wants is known.
class CornerBlender {
 public:
  explicit CornerBlender(PieceSink& sink) : sink_(sink) {}

  void add(const PathItem& item);

  /// The machine stops at the end of the last item added.
  void stop();

 private:
  void resolve_junction(double span_after_next);
  void emit_remainder(PathItem& item, double from, double to);
  void emit(PathItem& item, const PathPiece& piece, SourceLine source);
  void end_stretch();

  PieceSink& sink_;
  std::optional<PathItem> first_, second_;
  std::optional<PlanPiece> held_;  ///< the last piece, until it is known whether the stretch ends with it
  Junction junction_;              ///< between first_ and second_
  double first_from_ = 0;          ///< span of first_ that the blend before has taken
  double span_before_ = 0;         ///< span that it had wanted
};

}  // namespace trn
