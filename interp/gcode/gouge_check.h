#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "interp/gcode/plane_curve.h"

namespace trn {

/// Watches a compensated contour: wherever the tool goes along it, no move's contour may come closer to the
/// tool's centre than its radius. Knows every move since the contour began, whatever their number: a tree of
/// boxes finds the few that are near. A contour ends where it closes, where the tool leaves it (a rapid, a
/// move along the tool) or where compensation ends: one that follows may cut what an earlier one has left.
class GougeCheck {
 public:
  /// One move: the contour and the tool's centre beside it, with the arc about the corner behind it.
  struct Move {
    PlaneCurve contour, path;
    std::optional<PlaneCurve> corner;
    double low = 0, high = 0;  ///< along the plane's normal
    std::uint32_t line = 0;
  };

  /// A contour begins; `radius` of the tool.
  void begin(double radius);
  /// The next move of it. The line of the move that it gouges, or that gouges it; 0: none.
  std::uint32_t add(const Move& move);

  static constexpr std::size_t kMovesMax = 250'000;  ///< bounds the memory: a contour begins anew

 private:
  /// Boxes of kFan things each of the level below; the lowest level has those of the moves.
  using Level = std::vector<PlaneBox>;
  static constexpr std::size_t kFan = 16;

  static bool gouges(const Move& one, const Move& two, double least);
  template <typename Visit>
  void near(const PlaneBox& box, std::size_t level, std::size_t first, std::size_t last,
            const Visit& visit) const;
  void keep(const Move& move);
  void add_level();
  bool closes(const Move& move) const;

  double radius_ = 0;
  std::vector<Move> moves_;
  std::vector<Level> levels_;
};

}  // namespace trn
