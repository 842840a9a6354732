#pragma once

#include <cmath>

#include "core/axes.h"
#include "core/frames.h"
#include "core/realtime.h"

// Guards at the door of every kinematic function: garbage in is a status, never a NaN out.
namespace trn {

/// How far R's third column may be from unit length before the pose is refused as no pose at all.
inline constexpr double kUnitTolerance = 1e-6;

inline bool is_pose(const Pose& X) TRN_RT {
  const double sum = X.p.sum() + X.R.sum();  // one test for all: a NaN or infinity survives every sum
  return std::isfinite(sum) && std::abs(X.R.col(2).squaredNorm() - 1.0) < kUnitTolerance;
}

/// The same for machines that use all of R: three unit columns, right-handed.
inline bool is_rigid(const Pose& X) TRN_RT {
  if (!is_pose(X)) return false;
  const Vec3 x = X.R.col(0), y = X.R.col(1);
  return std::abs(x.squaredNorm() - 1.0) < kUnitTolerance &&
         (x.cross(y) - X.R.col(2)).norm() < kUnitTolerance;
}

/// The seed if it fits the machine, else zeros.
inline JointVec usable_seed(const JointVec& seed, int joint_count) TRN_RT {
  if (seed.size() == joint_count && std::isfinite(seed.sum())) return seed;
  return JointVec::Zero(joint_count);
}

}  // namespace trn
