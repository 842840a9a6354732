#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/frames.h"
#include "core/ports.h"
#include "interp/move.h"

namespace trn {

/// A place on a leg, as a share of it, and its distance to the point asked about.
struct LegPlace {
  double share = 0;  ///< 0 start, 1 end
  double distance_mm = 0;
};

/// One programmed move as the meter sees it: where the tip and the tool axis shall be at each share of the
/// move. Own geometry, so that a mistake in the planner's is seen. Lines, arcs and helices are exact. Rotary
/// words advance with the share.
class ProgrammedLeg {
 public:
  ProgrammedLeg(const ProgramMove& move, const Kinematics& kinematics);

  Vec3 tip(double share) const;
  Vec3 axis(double share) const;
  Vec3 end() const { return end_; }
  double tip_length_mm() const { return tip_length_mm_; }
  double turn_rad() const { return turn_rad_; }              ///< norm of the change of the rotary words
  double shares_at_once() const { return shares_at_once_; }  ///< as much as one search can look at
  double axis_way_deg() const { return axis_way_deg_; }      ///< length of the tool axis' way
  bool moves() const { return tip_length_mm_ > 0 || turn_rad_ > 0; }

  /// Tip and axis tolerance; 0 in the exact modes.
  double tolerance_mm() const { return tolerance_mm_; }
  double tolerance_deg() const { return tolerance_deg_; }

  /// Appends every local minimum of the distance from `p` between the two shares, in order.
  void nearest(const Vec3& p, double from, double to, std::vector<LegPlace>& out) const;

  /// How far (in shares) the path stays within `within_mm` of `p` from the minimum `place` on, towards the
  /// start (direction -1) or the end (+1), but not beyond `most`: exactly, or an upper bound that costs less.
  double reach(const Vec3& p, const LegPlace& place, double within_mm, int direction, double most) const;
  double reach_at_most(const Vec3& p, const LegPlace& place, double within_mm, int direction,
                       double most) const;

  /// The smallest angle (deg) between `u` and the programmed axis between the two shares, over all its
  /// minima; any angle not over `enough_deg` will do.
  double smallest_angle_deg(const Vec3& u, double from, double to, double enough_deg) const;

  /// A share between the two before which no programmed axis is within `within_deg` of `u`, nearly the last
  /// such one: the first where one may be. `to` where none is.
  double first_share_within(const Vec3& u, double from, double to, double within_deg) const;

 private:
  Vec3 tangent(double share) const;
  int turn_pieces(double shares) const;
  double arc_minimum(const Vec3& p, double from, double to) const;
  double refined_angle_deg(const Vec3& u, double from, double to, double enough_deg) const;

  const Kinematics* kinematics_;
  bool arc_ = false;
  Vec3 start_, end_, along_;  // line: start + along * share; arc: along its axis
  Vec3 radial_, sideways_;    // arc: start_ is on the axis then
  double sweep_rad_ = 0;
  Vec3 abc_, turn_;
  Vec3 axis_at_start_;
  double tip_length_mm_ = 0, turn_rad_ = 0;
  double rate_deg_ = 0;  // the tool axis goes no faster over a share
  double axis_way_deg_ = 0, shares_at_once_ = 1;
  double tolerance_mm_ = 0, tolerance_deg_ = 0;
};

/// Angle between two unit vectors, exact near 0 and near 180.
double angle_deg(const Vec3& a, const Vec3& b);

}  // namespace trn
