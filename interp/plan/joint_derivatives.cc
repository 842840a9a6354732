#include <algorithm>
#include <cmath>

#include "interp/plan/stages.h"

namespace trn {

namespace {

// A step that is small against the piece's own features, yet large enough that rounding of q (1e-14 of 100 mm)
// stays far below the jerk limits after division by its cube.
double sampling_step(const PathPiece& piece) {
  switch (piece.kind) {
    case PathPiece::Kind::kPolynomial: return piece.length / 64;
    case PathPiece::Kind::kArc: return std::min(0.01 / std::abs(piece.omega), 0.25);
    case PathPiece::Kind::kLine: break;
  }
  return 0.25;  // a line turns the rotary joints by at most 0.25 degrees in this step
}

double feed_speed(const PlanPiece& piece, double s) {
  const Words d1 = piece.piece.derivatives(s).d1;
  double speed = piece.feed.path_units_s;
  const double tip = d1.head<3>().norm(), rotary = d1.tail<3>().norm();
  if (tip > 1e-9) speed = std::min(speed, piece.feed.tip_mm_s / tip);
  if (rotary > 1e-12) speed = std::min(speed, piece.feed.rotary_rad_s / rotary);
  return speed;
}

}  // namespace

KinStatus joint_derivatives(const JointMap& map, const PlanPiece& piece, double s, JointDerivatives& out) {
  const double h = sampling_step(piece.piece);
  JointVec q[5];
  for (int k = 0; k < 5; ++k) {
    const KinStatus status = map.map(piece.piece.at(s + (k - 2) * h), piece.context, q[k]);
    if (status != KinStatus::kOk) return status;
  }
  out.q = q[2];
  out.d1 = (8 * (q[3] - q[1]) - (q[4] - q[0])) / (12 * h);
  out.d2 = (16 * (q[3] + q[1]) - (q[4] + q[0]) - 30 * q[2]) / (12 * h * h);
  out.d3 = ((q[4] - q[0]) - 2 * (q[3] - q[1])) / (2 * h * h * h);
  out.feed_speed = feed_speed(piece, s);
  return KinStatus::kOk;
}

}  // namespace trn
