#include "interp/plan/geometry/run_target.h"

#include <algorithm>

namespace trn {

namespace {

constexpr double kAwayMax = 0.5;  // of the tolerance: further off, the chord is more than a curve's sample

constexpr double kSlopeMax = 0.5;  // beyond the chord's own, of it: the cubic does not turn back

}  // namespace

RunTarget::RunTarget(std::span<const RunVertex> vertices, double tolerance_mm, double tolerance_rad)
    : vertices_(vertices), from_(vertices.size() - 1, Words::Zero()), to_(from_) {
  const auto slope = [&](size_t i) -> Words {
    return (vertices[i + 1].y - vertices[i].y) / (vertices[i + 1].u - vertices[i].u);
  };
  for (size_t i = 1; i + 1 < vertices.size(); ++i) {
    const double before = vertices[i].u - vertices[i - 1].u, after = vertices[i + 1].u - vertices[i].u;
    const Words turn = slope(i) - slope(i - 1);
    to_[i - 1] = before * (before / (before + after)) * turn;
    from_[i] = -after * (after / (before + after)) * turn;
  }
  if (vertices.size() > 2) {  // the parabolas at the ends go on
    from_.front() = -to_.front();
    to_.back() = -from_.back();
  }
  for (size_t i = 0; i < from_.size(); ++i) {
    const double length = vertices[i + 1].u - vertices[i].u;
    const Words away = (from_[i] - to_[i]) / 8, along = slope(i);  // in the chord's middle
    const Words across = away - along * place_along(away, along, tolerance_mm, tolerance_rad);
    const double over =
        std::max({1.0, tube_use(across, tolerance_mm, tolerance_rad).worst() / kAwayMax,
                  path_norm(from_[i]) / (kSlopeMax * length), path_norm(to_[i]) / (kSlopeMax * length)});
    from_[i] /= over;
    to_[i] /= over;
  }
}

Words RunTarget::at(size_t chord, double part) const {
  const Words& a = vertices_[chord].y;
  const double rest = 1 - part;
  return a + part * (vertices_[chord + 1].y - a) + part * rest * (rest * from_[chord] - part * to_[chord]);
}

}  // namespace trn
