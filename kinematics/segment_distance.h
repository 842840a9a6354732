#pragma once

#include <algorithm>

#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// Least distance between the segments a + s da and b + t db, s and t in [0, 1]; neither may be a point.
inline double segment_distance(const Vec3& a, const Vec3& da, const Vec3& b, const Vec3& db) TRN_RT {
  const Vec3 r = a - b;
  const double aa = da.squaredNorm(), bb = db.squaredNorm(), ab = da.dot(db);
  const double ar = da.dot(r), br = db.dot(r);
  const double cross = aa * bb - ab * ab;
  double s = cross > 1e-12 * aa * bb ? std::clamp((ab * br - bb * ar) / cross, 0.0, 1.0) : 0.0;
  const double t = std::clamp((ab * s + br) / bb, 0.0, 1.0);
  s = std::clamp((ab * t - ar) / aa, 0.0, 1.0);
  return (r + s * da - t * db).norm();
}

}  // namespace trn
