#pragma once

#include <algorithm>
#include <vector>

#include "interp/gcode/cutter/plane_curve.h"

namespace trn {

/// Boxes in the order of their things along a contour, where neighbours in the order are neighbours in the
/// plane: every kFan of them in a box of the level above. Grows by one at a time.
class BoxTree {
 public:
  void clear() { levels_.clear(); }
  std::size_t size() const { return levels_.empty() ? 0 : levels_.front().size(); }
  void add(const PlaneBox& box);

  /// Calls `visit(index)` for every box nearer to `box` than `reach`, in their order, until it returns true.
  template <typename Visit>
  void near(const PlaneBox& box, double reach, const Visit& visit) const {
    if (!levels_.empty()) near(box, reach * reach, levels_.size() - 1, 0, levels_.back().size(), visit);
  }

 private:
  using Level = std::vector<PlaneBox>;
  static constexpr std::size_t kFan = 16;

  void add_level();
  template <typename Visit>
  bool near(const PlaneBox& box, double reach2, std::size_t level, std::size_t first, std::size_t last,
            const Visit& visit) const;

  std::vector<Level> levels_;  ///< the lowest one first
};

template <typename Visit>
bool BoxTree::near(const PlaneBox& box, double reach2, std::size_t level, std::size_t first, std::size_t last,
                   const Visit& visit) const {
  for (std::size_t i = first; i < last; ++i) {
    if (levels_[level][i].squaredExteriorDistance(box) > reach2) continue;
    if (level == 0 ? visit(i)
                   : near(box, reach2, level - 1, i * kFan,
                          std::min((i + 1) * kFan, levels_[level - 1].size()), visit))
      return true;
  }
  return false;
}

}  // namespace trn
