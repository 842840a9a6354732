#pragma once

#include <cmath>

#include "core/axes.h"
#include "core/frames.h"

// What machines with errors really do, as products of 4x4 matrices written down from docs/sources.md S1
// and S2; nothing is shared with compensation/.
namespace trn::test {

using Mat4 = Eigen::Matrix4d;

/// E(e; th): offsets in mm, tilts in rad, first order.
inline Mat4 error_matrix(double ex, double ey, double ez, double tx, double ty, double tz) {
  Mat4 m;
  m << 1, -tz, ty, ex, tz, 1, -tx, ey, -ty, tx, 1, ez, 0, 0, 0, 1;
  return m;
}

/// Turn about x (0), y (1) or z (2).
inline Mat4 turn(int axis, double angle) {
  const int i = (axis + 1) % 3, j = (axis + 2) % 3;
  Mat4 m = Mat4::Identity();
  m(i, i) = m(j, j) = std::cos(angle);
  m(j, i) = std::sin(angle);
  m(i, j) = -m(j, i);
  return m;
}

inline Mat4 shift(double x, double y, double z) {
  Mat4 m = Mat4::Identity();
  m.topRightCorner<3, 1>() << x, y, z;
  return m;
}

/// The eight errors of the cradle's rotary axes, mm and rad.
struct Pige {
  double ey0a = 0, ez0a = 0, ty0a = 0, tz0a = 0, ex0c = 0, ey0c = 0, tx0c = 0, ty0c = 0;
};

/// Means of the second run of docs/sources.md S1.
inline Pige measured_pige() {
  constexpr double s = 3.14159265358979323846 / 180 / 3600;
  return {0.0335, -0.0356, 7.23 * s, 2.94 * s, 0.0014, -0.0513, -26.03 * s, -14.38 * s};
}

struct TipAxis {
  Vec3 tip, axis;
};

/// Section 1: tip and tool axis in the table frame at joints X Y Z A C, tool from the gauge point to the tip.
inline TipAxis cradle(const Pige& e, const JointVec& q, const Vec3& tool) {
  const Mat4 X_RW = error_matrix(0, e.ey0a, e.ez0a, 0, e.ty0a, e.tz0a) * turn(0, q[3]) *
                    error_matrix(e.ex0c, e.ey0c, 0, e.tx0c, e.ty0c, 0) * shift(0, 0, -75) * turn(2, q[4]);
  const Mat4 X_WR = X_RW.inverse();
  const Vec3 tip(q[0] - tool[0], q[1] - tool[1], q[2] - tool[2]);
  return {(X_WR * tip.homogeneous()).head<3>(), (X_WR * Eigen::Vector4d(0, 0, 1, 0)).head<3>()};
}
inline TipAxis cradle(const Pige& e, const JointVec& q, double tool) {
  return cradle(e, q, Vec3(0, 0, tool));
}

/// Section 2: an A/C head, tool branch X Y Z C A with errors of C and A; the table stands.
inline TipAxis head(const Mat4& E_C, const Mat4& E_A, const JointVec& q, double tool) {
  const Mat4 X = shift(q[0], q[1], q[2]) * E_C * turn(2, q[4]) * E_A * turn(0, q[3]);
  return {(X * Eigen::Vector4d(0, 0, -tool, 1)).head<3>(), (X * Eigen::Vector4d(0, 0, 1, 0)).head<3>()};
}

/// Angle between two directions of any length, rad.
inline double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace trn::test
