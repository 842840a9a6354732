#include <algorithm>
#include <cmath>

#include "interp/plan/stages.h"

namespace trn {

namespace {

// How far (in path_norm) the sampled points lie from the centre, by the curve's direction and by its bending:
// small against the radii of the machine and its distance from a pole (at 0.5 mm the third derivative is 0.1
// % off), yet so large that rounding of q (1e-14 of 100 mm) stays far below the jerk limits after division by
// the step's cube. Where the path bends, the machine is slow, and less will do.
constexpr double kReach = 0.01, kBendReach = 1e-4;

// The curve that shares value and three derivatives with the piece at s. It may be followed beyond the ends
// of a piece however short that is.
Words taylor(const PathPoint& p, double h) { return p.y + h * (p.d1 + (h / 2) * (p.d2 + (h / 3) * p.d3)); }

double sampling_step(const PathPoint& p) {
  const double n1 = path_norm(p.d1), n2 = path_norm(p.d2), n3 = path_norm(p.d3);
  double h = kReach / std::max(n1, 1e-9);
  if (n2 * h * h > 2 * kBendReach) h = std::sqrt(2 * kBendReach / n2);
  if (n3 * h * h * h > 6 * kBendReach) h = std::cbrt(6 * kBendReach / n3);
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
  out.q = q[2];
  out.d1 = (8 * (q[3] - q[1]) - (q[4] - q[0])) / (12 * h);
  out.d2 = (16 * (q[3] + q[1]) - (q[4] + q[0]) - 30 * q[2]) / (12 * h * h);
  out.d3 = ((q[4] - q[0]) - 2 * (q[3] - q[1])) / (2 * h * h * h);
  return KinStatus::kOk;
}

// Of the words [First, First + 3).
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

}  // namespace trn
