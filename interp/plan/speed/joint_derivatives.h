#pragma once

#include "core/ports.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// Positions of the motor joints (mm or rad) and their first three derivatives by the path parameter s.
struct JointDerivatives {
  PerJoint q{}, d1{}, d2{}, d3{};
};

/// The derivatives at s of the piece, from five evaluations of the joint map by central differences: of
/// fourth order for the first two, of second order for the third. Not kOk: an evaluation failed, and `out` is
/// unchanged.
KinStatus joint_derivatives(const JointMap& map, const PlanPiece& piece, double s, JointDerivatives& out);

/// The greatest ds/dt that the program's feed allows at s of the piece, path units per s; infinite for a
/// rapid.
double feed_speed(const PlanPiece& piece, double s);

}  // namespace trn::speed
