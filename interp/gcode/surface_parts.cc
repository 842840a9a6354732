#include "interp/gcode/surface_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/axes.h"
#include "core/check.h"

namespace trn {

namespace {

constexpr double kSpeedStep = 1.03;  // from one part to the next
constexpr int kPartsMax = 512;       // of one move
constexpr int kArcPartsLeast = 8;    // of a whole turn both ends are the same place
constexpr double kSamePlace_mm = 1e-9;

double rpm_at(const SurfaceSpeed& law, const PathPiece& path, int k, int parts) {
  return std::abs(law.rpm_at(path.at(path.length * k / parts).head<3>()));
}

}  // namespace

std::vector<double> speed_steps(const SurfaceSpeed& law, const Words& from, const Words& to) {
  std::vector<double> shares;
  const double from_mm = law.across.dot(from.head<3>()) - law.axis_mm;
  const double way_mm = law.across.dot((to - from).head<3>());
  if (!law.acts() || std::abs(way_mm) < kSamePlace_mm) return shares;
  TRN_CHECK(law.rpm_max > 0);
  const double least_mm = std::abs(law.rpm_mm) / law.rpm_max;
  const double most_mm = std::max(std::abs(from_mm), std::abs(from_mm + way_mm));
  const double step = std::max(kSpeedStep, std::pow(most_mm / least_mm, 2.0 / kPartsMax));
  for (double mm = least_mm; mm < most_mm; mm *= step)
    for (const double at_mm : {-mm, mm}) {
      const double share = (at_mm - from_mm) / way_mm;
      if (share > 0 && share < 1) shares.push_back(share);
    }
  std::sort(shares.begin(), shares.end());
  return shares;
}

int speed_parts(const SurfaceSpeed& law, const PathPiece& arc) {
  if (!law.acts()) return 1;
  int parts = kArcPartsLeast;
  const auto fine = [&] {
    for (int k = 0; k < parts; ++k) {
      const double change = rpm_at(law, arc, k, parts) / rpm_at(law, arc, k + 1, parts);
      if (change > kSpeedStep || change < 1 / kSpeedStep) return false;
    }
    return true;
  };
  while (parts < kPartsMax && !fine()) parts *= 2;
  return parts;
}

double least_rpm(const SurfaceSpeed& law, const PathPiece& path) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kPartsMax; ++k) least = std::min(least, rpm_at(law, path, k, kPartsMax));
  return least;
}

}  // namespace trn
