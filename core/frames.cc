#include "core/frames.h"

#include <cmath>

namespace trn {

Mat3 rot_x(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << 1, 0, 0, 0, c, -s, 0, s, c;
  return R;
}

Mat3 rot_y(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << c, 0, s, 0, 1, 0, -s, 0, c;
  return R;
}

Mat3 rot_z(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << c, -s, 0, s, c, 0, 0, 0, 1;
  return R;
}

Mat3 turn_between(const Vec3& from, const Vec3& to) TRN_RT {
  const double c = from.dot(to);
  if (c < 0) {
    // Near the opposite the formula below divides by next to nothing. Half a turn about an axis across `from`
    // leaves the short rest of the way, in the plane of both vectors where they have one.
    Vec3 axis = from.cross(to);
    if (axis.squaredNorm() < 1e-24) {
      int least = 0;
      from.cwiseAbs().minCoeff(&least);
      axis = from.cross(Vec3::Unit(least));
    }
    axis.normalize();  // what rounding left of `from` in a short one is taken out behind that
    axis = (axis - from * from.dot(axis)).normalized();
    const Mat3 half = 2 * axis * axis.transpose() - Mat3::Identity();
    return turn_between(-from, to) * half;
  }
  // Rodrigues' formula, with sin^2 = (1 - cos) (1 + cos) taken out of (1 - cos) / sin^2.
  const Vec3 v = from.cross(to);
  Mat3 V;
  V << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return Mat3::Identity() + V + V * V / (1 + c);
}

}  // namespace trn
