#pragma once

#include <span>
#include <vector>

#include "core/axes.h"
#include "interp/plan/geometry/run_vertex.h"

namespace trn {

/// The curve that a polyline was probably taken from: a cubic between neighbouring vertices, at most half the
/// tolerance away from the chord. Its slopes at the vertices are those of the parabolas through three
/// vertices, corrected by what the next two show of the third derivative, hence of fourth order. A curve
/// fitted to it comes out alike for long and for short chords; fitted to the chords, it would follow their
/// corners.
class RunTarget {
 public:
  /// The vertices, at least two, must outlive it.
  RunTarget(std::span<const RunVertex> vertices, double tolerance_mm, double tolerance_rad);

  /// The target at `part` (0 to 1) of chord `chord`, which leads from vertex `chord` to the next.
  Words at(size_t chord, double part) const;

  /// The sag of the target, its deviation from a chord's middle, interpolated between the chords' middles.
  Words sag(size_t chord, double part) const;

  std::span<const RunVertex> vertices() const { return vertices_; }

 private:
  void find_slopes();
  void bound_sag(double tolerance_mm, double tolerance_rad);

  std::span<const RunVertex> vertices_;
  std::vector<Words> from_, to_;  ///< by chord: slope beyond its own at its ends, times its length
  std::vector<Words> sag_;        ///< by chord
};

}  // namespace trn
