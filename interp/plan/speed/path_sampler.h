#pragma once

#include <vector>

#include "interp/plan/speed/joint_curve.h"

namespace trn::speed {

/// The bracket at one place of the path, from one side: derivatives of the motor joints by s, and the bound
/// that feed and joint velocity put on b = (ds/dt)^2.
struct PathSample {
  double s = 0;      ///< from the start of the stretch
  double b_max = 0;  ///< per s^2
  PerJoint d1{}, d2{}, d3{};
};

/// Local bounds of the path parameter's own motion, ignoring what happens before and after.
struct LocalBound {
  double b = 0;             ///< (ds/dt)^2 with constant speed, curvature and its change included
  double acceleration = 0;  ///< d2s/dt2 at rest
  double jerk = 0;          ///< d3s/dt3 at rest
};

/// Samples the bracket and judges position limits. Throws ProgramError ("line N: ...") when the map fails or
/// a joint would leave its range.
class PathSampler {
 public:
  PathSampler(const Joints& joints, const JointMap& map, const JointRates& rates);

  /// Puts the joints along the piece, where polynomials tell them, into `out`.
  void curve(const PlanPiece& piece, JointCurve& out) const;
  /// At `s_piece` of the piece; `s` is the place in the stretch. Joints are judged within `reach` of s_piece
  /// too, as far as a parabola tells.
  PathSample sample(const PlanPiece& piece, const JointCurve& curve, double s_piece, double s,
                    double reach) const;
  LocalBound bound(const PathSample& sample) const;
  /// Parabolas through three samples `step` apart tell the joints' second and third derivatives over [s0, s1]
  /// of the piece, halfway between the samples, to this share of the limits at (ds/dt)^2 = b, as far as
  /// bounds of the curve show.
  bool parabolas_tell(const PlanPiece& piece, const JointCurve& curve, double s0, double s1, double step,
                      double b, double share) const;

  const JointRates& rates() const { return rates_; }

 private:
  void add_panels(const PlanPiece& piece, double s0, double s1, int halvings, JointCurve& curve) const;
  bool tells(const PlanPiece& piece, const JointPanel& panel) const;
  Bracket ask(const PlanPiece& piece, double s_piece) const;
  void check_position(const PlanPiece& piece, const Bracket& d, double reach) const;
  double speed_bound(const PlanPiece& piece, const Bracket& d, double s_piece) const;
  void weigh(const PlanPiece& piece, double s_piece, PathSample& out) const;

  const Joints& joints_;
  const JointMap& map_;
  JointRates rates_;
};

}  // namespace trn::speed
