#pragma once

#include <Eigen/Dense>

#include "core/realtime.h"

// Frames (docs/architecture.md): W work, B table (what carries the work), M machine base, S spindle nose,
// T tool tip. X_AB is the pose of B in A; neighbours must match: X_AC = X_AB * X_BC.
namespace trn {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// Rigid pose X_AB: rotation R_AB and translation p_AB (mm).
struct Pose {
  Mat3 R = Mat3::Identity();
  Vec3 p = Vec3::Zero();
};

inline Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  return {X_AB.R * X_BC.R, X_AB.p + X_AB.R * X_BC.p};
}
inline Vec3 operator*(const Pose& X_AB, const Vec3& p_B) { return X_AB.p + X_AB.R * p_B; }
inline Pose inverse(const Pose& X_AB) { return {X_AB.R.transpose(), -(X_AB.R.transpose() * X_AB.p)}; }
inline Pose translation(const Vec3& p) TRN_RT { return {Mat3::Identity(), p}; }

/// Rotation by +angle_rad about x, y or z (right-handed).
Mat3 rot_x(double angle_rad) TRN_RT;
Mat3 rot_y(double angle_rad) TRN_RT;
Mat3 rot_z(double angle_rad) TRN_RT;

/// The shortest turn that brings the unit vector `from` to the unit vector `to`; for opposite ones, by half a
/// turn about some axis across them.
Mat3 turn_between(const Vec3& from, const Vec3& to) TRN_RT;

}  // namespace trn
