#pragma once

#include <Eigen/Dense>
#include <vector>

#include "core/realtime.h"

namespace trn {

/// What the teeth leave of a boss that is cut out of a plate: the envelope of their paths, kept over the
/// polar angle about the part's middle as the distance by which the part's own shape measures (radius of a
/// round part, half width of a square one). The measurement of the part uses nothing else.
class PartSurface {
 public:
  static constexpr double kMarkRad = 0.25;
  static constexpr double kSideShare = 0.8;  ///< of a square's side that is measured, about its middle

  enum class Shape : unsigned char { kRound, kSquare };
  struct Config {
    Shape shape = Shape::kRound;
    Eigen::Vector2d middle_mm = Eigen::Vector2d::Zero();
    int bins =
        1800;  ///< each wider than a tooth's way in a step of the simulation (20 um), or it may stay uncut
  };

  explicit PartSurface(const Config& config);

  /// Distance of a point by the part's measure, mm.
  double distance_mm(const Eigen::Vector2d& p_mm) const TRN_RT;
  /// Whether the plate still has material there. What is cut counts as gone once the tool is past it.
  bool has_material(const Eigen::Vector2d& p_mm) const TRN_RT;
  /// A tooth has passed here.
  void cut(const Eigen::Vector2d& p_mm) TRN_RT;
  /// The tool's centre is here: what lies well behind it is settled.
  void settle(const Eigen::Vector2d& centre_mm) TRN_RT;

  /// Mean diameter over the turn but for kMarkRad on both sides of -x, where the tool comes and goes; NaN
  /// while a part of it is uncut, mm.
  double diameter_mm() const;
  /// Mean width along axis 0 (x) or 1 (y) over the middle 80 % of the sides; NaN while uncut, mm.
  double width_mm(int axis) const;
  /// Surface over the angle: distance, mm, or infinity where uncut; bin i is at 2 pi (i + 1/2) / bins.
  const std::vector<double>& distances_mm() const { return nearest_; }

 private:
  int bin_of(const Eigen::Vector2d& p_mm) const TRN_RT;
  double side_mean(int axis, bool plus) const;

  Config config_;
  std::vector<double> nearest_, farthest_;  ///< of all teeth so far
  std::vector<double> settled_nearest_, settled_farthest_;
  int settled_to_ = -1;
};

}  // namespace trn
