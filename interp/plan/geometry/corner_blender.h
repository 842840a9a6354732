#pragma once

#include <optional>

#include "interp/plan/geometry/corner_blend.h"

namespace trn {

/// Rounds the corners between items and hands the pieces on. Holds two items: a blend is final once the wish
/// of the next junction is known, because both share the item between them.
class CornerBlender {
 public:
  explicit CornerBlender(PieceSink& sink) : sink_(sink) {}

  void add(const PathItem& item);

  /// The machine stops at the end of the last item added.
  void stop();

 private:
  void resolve_junction(double span_after_next);
  void emit_remainder(PathItem& item, double from, double to);
  void emit(PathItem& item, const PathPiece& piece, std::uint32_t line);
  void end_stretch();

  PieceSink& sink_;
  std::optional<PathItem> first_, second_;
  std::optional<PlanPiece> held_;  ///< the last piece, until it is known whether the stretch ends with it
  Junction junction_;              ///< between first_ and second_
  double first_from_ = 0;          ///< what the blend before has taken of first_
  double span_before_ = 0;         ///< what that blend had wished
};

}  // namespace trn
