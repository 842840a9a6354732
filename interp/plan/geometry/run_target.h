#pragma once

#include <span>
#include <vector>

#include "interp/plan/geometry/run_vertex.h"

namespace trn {

/// The curve that a polyline was probably taken from: a cubic between neighbouring vertices, at most a share
/// of the tolerances away from the chord. Its slopes are those of the parabolas through three vertices, less
/// the error that the next two show (so of fourth order). What is fitted to it comes out alike for long and
/// for short chords, where the chords themselves would ask for their corners.
class RunTarget {
 public:
  /// The vertices, at least two, must outlive it.
  RunTarget(std::span<const RunVertex> vertices, double tolerance_mm, double tolerance_rad);

  /// On chord i (from vertex i to the next), at `part` of it.
  Words at(size_t chord, double part) const;

  /// How far it lies off the middles of the chords around there.
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
