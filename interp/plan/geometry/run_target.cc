#include "interp/plan/geometry/run_target.h"

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

constexpr double kSagMax = 0.5;  // of the tolerance: with more, the chord is no sample of a curve but a line
constexpr double kSlopeMax = 0.5;  // of the chord's slope, added to it: the cubic does not turn back

Words chord_slope(std::span<const RunVertex> v, size_t i) {
  return (v[i + 1].y - v[i].y) / (v[i + 1].u - v[i].u);
}

}  // namespace

RunTarget::RunTarget(std::span<const RunVertex> vertices, double tolerance_mm, double tolerance_rad)
    : vertices_(vertices), from_(vertices.size() - 1, Words::Zero()), to_(from_), sag_(from_) {
  find_slopes();
  bound_sag(tolerance_mm, tolerance_rad);
}

// A slope by three vertices is off by before * after / 6 of y''', since the parabola lacks that term. The
// second difference of the parabolas' slopes gives y''' from five vertices, and the error is taken off. The
// first and the last chord have one neighbour only: there the parabola of the neighbour goes on.
void RunTarget::find_slopes() {
  const size_t n = vertices_.size();
  const auto length = [&](size_t i) { return vertices_[i + 1].u - vertices_[i].u; };
  std::vector<Words> parabola(n, Words::Zero());
  for (size_t i = 1; i + 1 < n; ++i)
    parabola[i] = (length(i) * chord_slope(vertices_, i - 1) + length(i - 1) * chord_slope(vertices_, i)) /
                  (length(i - 1) + length(i));
  for (size_t i = 1; i + 1 < n; ++i) {
    const double before = length(i - 1), after = length(i);
    Words slope = parabola[i];
    if (i > 1 && i + 2 < n)
      slope -= (before * (parabola[i + 1] - parabola[i]) - after * (parabola[i] - parabola[i - 1])) /
               (3 * (before + after));
    to_[i - 1] = before * (slope - chord_slope(vertices_, i - 1));
    from_[i] = after * (slope - chord_slope(vertices_, i));
  }
  if (n > 2) {
    from_.front() = -to_.front();
    to_.back() = -from_.back();
  }
}

// Scales a chord's cubic towards the chord where its sag across the path, or the change of its slope, is too
// large. A deviation along the chord is no sag: the curve is only early or late there.
void RunTarget::bound_sag(double tolerance_mm, double tolerance_rad) {
  for (size_t i = 0; i < from_.size(); ++i) {
    const double length = vertices_[i + 1].u - vertices_[i].u;
    const Words away = (from_[i] - to_[i]) / 8, along = chord_slope(vertices_, i);  // in the chord's middle
    const Words across = away - along * nearest_along(away, along, tolerance_mm, tolerance_rad);
    const double over =
        std::max({1.0, tube_use(across, tolerance_mm, tolerance_rad).worst() / kSagMax,
                  path_norm(from_[i]) / (kSlopeMax * length), path_norm(to_[i]) / (kSlopeMax * length)});
    from_[i] /= over;
    to_[i] /= over;
    sag_[i] = across / over;
  }
}

Words RunTarget::at(size_t chord, double part) const {
  const Words& a = vertices_[chord].y;
  const double rest = 1 - part;
  return a + part * (vertices_[chord + 1].y - a) + part * rest * (rest * from_[chord] - part * to_[chord]);
}

Words RunTarget::sag(size_t chord, double part) const {
  const size_t before = chord - std::min<size_t>(chord, 1), after = std::min(chord + 1, sag_.size() - 1);
  const Words& beside = sag_[part < 0.5 ? before : after];
  return sag_[chord] + (beside - sag_[chord]) * std::abs(part - 0.5);
}

}  // namespace trn
