#pragma once

#include "core/frames.h"
#include "core/realtime.h"

namespace trn {

/// Solves columns * x = rhs by Cramer's rule. Returns the volume that the columns span; where it is 0, or
/// next to it, x is meaningless and may be infinite.
inline double solve3(const Mat3& columns, const Vec3& rhs, Vec3& x) TRN_RT {
  const Vec3 a = columns.col(0), b = columns.col(1), c = columns.col(2);
  const Vec3 bc = b.cross(c);
  const double volume = a.dot(bc);
  x = Vec3(rhs.dot(bc), rhs.dot(c.cross(a)), rhs.dot(a.cross(b))) / volume;
  return volume;
}

}  // namespace trn
