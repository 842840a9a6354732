#include "interp/gcode/spline_chords.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/check.h"
#include "interp/gcode/error.h"

namespace trn {

namespace {

constexpr double kChord_mm = 0.002;
constexpr double kChordsMax = 200'000;  // some 10 km, and 10 MB

Vec3 bezier(const Vec3* c, double t) {
  const double s = 1 - t;
  return s * s * s * c[0] + 3 * s * s * t * c[1] + 3 * s * t * t * c[2] + t * t * t * c[3];
}

// How many chords stay near enough to this piece.
double chords_of(const Vec3* c, double scale) {
  const double bend = std::max((c[0] - 2 * c[1] + c[2]).norm(), (c[1] - 2 * c[2] + c[3]).norm()) * scale;
  return std::max(1.0, std::ceil(std::sqrt(0.75 * bend / kChord_mm)));
}

}  // namespace

std::vector<Vec3> spline_chords(const std::vector<Vec3>& hull, double scale) {
  TRN_CHECK(!hull.empty() && hull.size() % 4 == 0);
  double all = 0;
  for (std::size_t i = 0; i + 3 < hull.size(); i += 4) all += chords_of(hull.data() + i, scale);
  if (!(all <= kChordsMax))
    fail(GcodeErrorCode::kSpline, 1, "the curve is longer than any machine",
         "its control points and tangents nearer to each other");
  std::vector<Vec3> ends;
  for (std::size_t i = 0; i + 3 < hull.size(); i += 4) {
    const Vec3* c = hull.data() + i;
    const int chords = static_cast<int>(chords_of(c, scale));
    for (int k = 1; k <= chords; ++k) ends.push_back(bezier(c, static_cast<double>(k) / chords));
  }
  return ends;
}

}  // namespace trn
