#pragma once

#include <array>

#include "core/axes.h"
#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// Value and first three derivatives of the six words by the path parameter s.
struct PathPoint {
  Words y, d1, d2, d3;
};

/// One piece of programmed geometry: the six words y as a smooth function of the path parameter
/// s in [0, length]. With RTCP on, y is the tip in table frame B (mm) and the rotary words (rad); with RTCP
/// off, y is the machine's own axes. s is a generalised length: a line advances one unit in the norm of
/// `path_norm`. Neighbouring pieces of a stretch join with continuous y, y', y'', y''' (by s).
/// All kinds extend smoothly beyond their ends.
struct PathPiece {
  enum class Kind : unsigned char { kLine, kArc, kPolynomial };

  Kind kind = Kind::kLine;
  double length = 0;  ///< range of s; > 0
  double omega = 0;   ///< arc: rad per unit of s, signed
  /// line: y = c0 + c1 s.  arc: y = c0 + c1 s + c2 cos(omega s) + c3 sin(omega s).
  /// polynomial: y = sum c_k (s / length)^k.
  std::array<Words, 8> c;

  Words at(double s) const TRN_RT;
  PathPoint derivatives(double s) const TRN_RT;
};

/// Weight of a rotation against a length in the path parameter: 1 rad counts as this many mm, so that one
/// degree counts like one millimetre.
inline constexpr double kMmPerRadInPath = 57.29577951308232;

/// The norm whose unit is the path parameter: sqrt(|dp|^2 + (kMmPerRadInPath |dabc|)^2).
double path_norm(const Words& dy);

PathPiece make_line(const Words& from, const Words& to);

/// Arc or helix about `axis` (unit) through `from` with centre `centre`, turning by `sweep_rad` (signed,
/// right-handed about the axis, any number of turns), while the component along the axis and the rotary
/// words move linearly to those of `to`.
PathPiece make_arc(const Words& from, const Words& to, const Vec3& centre, const Vec3& axis,
                   double sweep_rad);

/// Polynomial of degree 7 with the given value and three derivatives at s = 0 and s = length.
PathPiece make_hermite(const PathPoint& from, const PathPoint& to, double length);

/// The part of `piece` between s0 and s1, with its own parameter starting at 0.
PathPiece cut(const PathPiece& piece, double s0, double s1);

}  // namespace trn
