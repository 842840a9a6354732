#pragma once

#include "core/axes.h"
#include "core/ports.h"
#include "interp/plan/speed/joint_curve.h"
#include "interp/plan/speed/joint_derivatives.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// The joints' motion at one place of the path, from one side: derivatives of the motor joints by s (mm or
/// rad), and the bound that feed and joint velocity put on b = (ds/dt)^2 (P4 of docs/planner.md).
struct PathSample {
  double s = 0;      ///< from the start of the stretch
  double b_max = 0;  ///< per s^2
  PerJoint d1{}, d2{}, d3{};
};

/// The sample at s on the parabola through three samples, which ascend in s; for the first `count` joints.
PathSample interpolate(const PathSample* three, double s, int count);

/// Local bounds of the path parameter's own motion, ignoring what happens before and after.
struct LocalBound {
  double b = 0;             ///< (ds/dt)^2 at constant speed, with the terms in q'' and q''' of P5 and P6
  double acceleration = 0;  ///< d2s/dt2 at rest
  double jerk = 0;          ///< d3s/dt3 at rest
};

/// Samples the joint map along a piece and checks position limits. Throws ProgramError ("line N: ...") when
/// the map fails or a joint would leave its range.
class PathSampler {
 public:
  /// The references must outlive the sampler.
  PathSampler(const Joints& joints, const JointMap& map, const JointRates& rates);

  /// The stretch begins with this piece, at whose beginning the machine stands already. Where a joint is
  /// outside its range there, as behind a homing switch at the end, the way in is open: it may be as far out
  /// as that. Whoever hands in the path sees to it that it goes no further out on the way.
  void begin(const PlanPiece& first);

  /// Puts polynomials of the joints along the piece into `out`, wherever they are accurate enough.
  void curve(const PlanPiece& piece, JointCurve& out) const;

  /// The sample at `s_piece` of the piece; `s` is its place in the stretch. Where a joint turns back within
  /// `reach` of s_piece, the turning point is checked too.
  PathSample sample(const PlanPiece& piece, const JointCurve& curve, double s_piece, double s,
                    double reach) const;

  LocalBound bound(const PathSample& sample) const;

  /// True: parabolas through three samples `step` apart give the joints' second and third derivatives over
  /// [s0, s1] of the piece, halfway between the samples, to within this share of the limits at (ds/dt)^2 = b.
  /// False: the bounds of the curve do not show it.
  bool parabolas_predict(const PlanPiece& piece, const JointCurve& curve, double s0, double s1, double step,
                         double b, double share) const;

  const JointRates& rates() const { return rates_; }

 private:
  void add_panels(const PlanPiece& piece, double s0, double s1, int halvings, JointCurve& curve) const;
  bool is_accurate(const PlanPiece& piece, const JointPanel& panel) const;
  JointDerivatives map_derivatives(const PlanPiece& piece, double s_piece) const;
  void check_position(const PlanPiece& piece, const JointDerivatives& d, double s_piece, double reach) const;
  double farthest(const PlanPiece& piece, size_t joint, double s_piece, double reach, double side) const;
  double speed_bound(const PlanPiece& piece, const JointDerivatives& d, double s_piece) const;
  void scale_to_tip_acceleration(const PlanPiece& piece, double s_piece, PathSample& out) const;

  const Joints& joints_;
  const JointMap& map_;
  JointRates rates_;
  PerJoint lowest_, highest_;  ///< positions that are allowed, joint by joint
};

}  // namespace trn::speed
