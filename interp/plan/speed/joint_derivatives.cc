#include "interp/plan/speed/joint_derivatives.h"

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "core/frames.h"
#include "core/path.h"

namespace trn::speed {

namespace {

// How far the outer evaluations lie from the centre, in path_norm: along the tangent, and by the path's own
// curvature. The distance is small against the radii of the machine and its distance from a pole: at 0.5 mm
// the third derivative would be 0.1 % off. It is large enough that rounding of q (1e-14 of 100 mm) stays far
// below the jerk limits after division by the step's cube. A curved path is driven slowly, so a shorter step
// is accurate enough there.
constexpr double kReach = 0.01, kCurvedReach = 1e-4;

// The cubic that shares value and three derivatives with the piece at s, at a distance h from it. Unlike the
// piece it may be followed beyond the piece's ends, however short the piece is.
Words taylor(const PathPoint& p, double h) { return p.y + h * (p.d1 + (h / 2) * (p.d2 + (h / 3) * p.d3)); }

PerJoint per_joint(const JointVec& values) {
  PerJoint out{};
  for (int i = 0; i < values.size(); ++i) out[static_cast<size_t>(i)] = values[i];
  return out;
}

double sampling_step(const PathPoint& p) {
  const double n1 = path_norm(p.d1), n2 = path_norm(p.d2), n3 = path_norm(p.d3);
  double h = kReach / std::max(n1, 1e-9);
  if (n2 * h * h > 2 * kCurvedReach) h = std::sqrt(2 * kCurvedReach / n2);
  if (n3 * h * h * h > 6 * kCurvedReach) h = std::cbrt(6 * kCurvedReach / n3);
  return h;
}

}  // namespace

KinStatus joint_derivatives(const JointMap& map, const PlanPiece& piece, double s, JointDerivatives& out) {
  const PathPoint p = piece.piece.derivatives(s);
  const double h = sampling_step(p);
  JointVec q[5];
  for (int k = 0; k < 5; ++k) {
    const KinStatus status = map.map(taylor(p, (k - 2) * h), piece.context, q[k]);
    if (status != KinStatus::kOk) return status;
  }
  const JointVec d1 = (8 * (q[3] - q[1]) - (q[4] - q[0])) / (12 * h);
  const JointVec d2 = (16 * (q[3] + q[1]) - (q[4] + q[0]) - 30 * q[2]) / (12 * h * h);
  const JointVec d3 = ((q[4] - q[0]) - 2 * (q[3] - q[1])) / (2 * h * h * h);
  out = {per_joint(q[2]), per_joint(d1), per_joint(d2), per_joint(d3)};
  return KinStatus::kOk;
}

// Norm of dy/ds over the words [First, First + 3).
template <int First>
static double tangent(const PathPiece& piece, double s) {
  if (piece.kind != PathPiece::Kind::kPolynomial) return piece.derivatives(s).d1.segment<3>(First).norm();
  const double u = s / piece.length;
  Vec3 d1 = 7 * piece.c[7].segment<3>(First);
  for (int k = 6; k > 0; --k) d1 = d1 * u + k * piece.c[static_cast<size_t>(k)].segment<3>(First);
  return d1.norm() / piece.length;
}

double feed_speed(const PlanPiece& piece, double s) {
  double speed = piece.feed.path_units_s;
  if (std::isfinite(piece.feed.tip_mm_s)) {
    const double tip = tangent<0>(piece.piece, s);
    if (tip > 1e-9) speed = std::min(speed, piece.feed.tip_mm_s / tip);
  }
  if (std::isfinite(piece.feed.rotary_rad_s)) {
    const double rotary = tangent<3>(piece.piece, s);
    if (rotary > 1e-12) speed = std::min(speed, piece.feed.rotary_rad_s / rotary);
  }
  return speed;
}

}  // namespace trn::speed
