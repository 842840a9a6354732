#include <cmath>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/solve_in_place.h"
#include "kinematics/serial/chain.h"
#include "kinematics/serial/serial_kinematics.h"

namespace trn {

namespace {

// The tick may call this, so the number of steps is bounded. A pose in reach takes a few; near a singularity
// the damping makes them many and small.
constexpr int kIterationsMax = 100;
constexpr double kReachedMm = 1e-9, kReachedRad = 1e-12;
// A tip that is off by 1 mm counts as much as an axis that is off by 0.01 rad, which 100 mm of tool make 1 mm
// of.
constexpr double kMmPerRad = 100.0;  // weight of the tool axis against the tip

using Residual = Eigen::Matrix<double, 6, 1>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxJoints, kMaxJoints>;

/// What is missing to the wanted pose: tip (mm) and tool axis (turn vector, weighted to mm).
Residual residual_of(const Pose& X, const Pose& wanted) TRN_RT {
  Residual e;
  const Vec3 u = X.R.col(2), u_wanted = wanted.R.col(2);
  // The cross product vanishes for opposite axes too; there any turn across the tool will do.
  const bool opposite = u.dot(u_wanted) < 0 && u.cross(u_wanted).squaredNorm() < 1e-12;
  e << wanted.p - X.p, kMmPerRad * (opposite ? Vec3(X.R.col(0)) : Vec3(u.cross(u_wanted)));
  return e;
}

bool reached(const Residual& e) TRN_RT {
  return e.head<3>().norm() < kReachedMm && e.tail<3>().norm() < kReachedRad * kMmPerRad;
}

/// Tool-axis rows of the Jacobian: u x du = (I - u u^T) w.
void project_axis_rows(const Vec3& u, SerialChain::Jacobian& J) TRN_RT {
  // A turn about the tool changes nothing of the tool axis, so its part along u is taken out: nobody asks for
  // it.
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    const Vec3 w = J.col(i).tail<3>();
    J.col(i).tail<3>() = kMmPerRad * (w - u * u.dot(w));
  }
}

JointVec damped_step(const SerialChain::Jacobian& J, const Residual& e, double damping) TRN_RT {
  Square A = J.transpose().lazyProduct(J);
  // Marquardt's scaling of the damping by the diagonal, so that mm and rad are damped alike. The 1 beside it
  // keeps the matrix regular where a joint moves nothing, as a turn about the tool does.
  for (Eigen::Index i = 0; i < A.rows(); ++i) A(i, i) += damping * (1.0 + A(i, i));
  JointVec step = J.transpose().lazyProduct(e);
  solve_in_place(A, step);
  return step;
}

}  // namespace

KinStatus solve_by_newton(const SerialChain& chain, const Pose& X_BS, JointVec& q) TRN_RT {
  SerialChain::Jacobian J;
  double damping = 1e-3;
  Pose X = chain.pose_and_jacobian(q, J);
  Residual e = residual_of(X, X_BS);
  for (int i = 0; i < kIterationsMax && !reached(e); ++i) {
    // It changes J in place and weights it, so it must act once for each J: behind a step that was given up J
    // is computed anew.
    project_axis_rows(X.R.col(2), J);
    const JointVec next = q + damped_step(J, e, damping);
    SerialChain::Jacobian J_next;
    const Pose X_next = chain.pose_and_jacobian(next, J_next);
    const Residual e_next = residual_of(X_next, X_BS);
    const bool better = e_next.squaredNorm() < e.squaredNorm();  // false for a NaN, too
    damping = better ? damping * 0.01 : std::min(damping * 30.0 + 1e-12, 1e6);
    if (!better) {
      chain.pose_and_jacobian(q, J);
      continue;
    }
    q = next;
    X = X_next;
    e = e_next;
    J = J_next;
  }
  // The residual of an axis that is turned by 180 degrees is not 0 (see `residual_of`), yet the last test is
  // made on the axes themselves: a tool that looks away from the work is no answer.
  return reached(e) && X.R.col(2).dot(X_BS.R.col(2)) > 0 ? KinStatus::kOk : KinStatus::kUnreachable;
}

}  // namespace trn
