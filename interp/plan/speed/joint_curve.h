#pragma once

#include <vector>

#include "core/ports.h"
#include "interp/plan/lanes.h"
#include "interp/plan/speed/joint_derivatives.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// The motor joints over a part of a piece as polynomials of the path parameter: Chebyshev interpolation
/// (Trefethen, Approximation Theory and Approximation Practice, chapters 3 and 7) on a range a quarter longer
/// than the part, so that derivatives hold up to its ends. One evaluation of the joint map a node.
class JointPanel {
 public:
  static constexpr int kNodes = 10;

  /// Over [s0, s1] of the piece. False: the map fails somewhere.
  bool interpolate(const JointMap& map, const PlanPiece& piece, double s0, double s1);
  /// At s in [s0, s1].
  void at(double s, JointDerivatives& out) const;

  double s0() const { return s0_; }
  double s1() const { return s1_; }
  /// Estimated errors of the second and third derivatives, by joint: those of a next term as large as the
  /// last one that was kept.
  const PerJoint& error2() const { return error2_; }
  const PerJoint& error3() const { return error3_; }
  /// Bounds of the fifth and sixth derivatives by s over the panel, by joint, mm or rad.
  const PerJoint& d5_max() const { return d5_max_; }
  const PerJoint& d6_max() const { return d6_max_; }
  /// True: the errors are rounding of the joints' values, which counts more on a shorter panel.
  bool rounding() const { return rounding_; }

 private:
  void set_joint(int joint, const std::array<double, kNodes>& values, double rounding);

  double s0_ = 0, s1_ = 0, middle_ = 0, inverse_ = 0;  ///< x = (s - middle) inverse
  int count_ = 0;
  size_t terms_ = 1;  ///< coefficients that any joint has
  bool rounding_ = true;
  PerJoint error2_{}, error3_{}, d5_max_{}, d6_max_{};
  Eight power_[2][kNodes] = {};  ///< coefficients of x^k; eight joints, then the rest
};

/// Panels of one piece, ascending in s. Where none lies, the joint map itself gives the derivatives.
using JointCurve = std::vector<JointPanel>;

/// The panel at s, or none.
const JointPanel* panel_at(const JointCurve& curve, double s);

}  // namespace trn::speed
