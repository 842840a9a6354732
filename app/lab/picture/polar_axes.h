#pragma once

#include <string>

#include "app/lab/picture/svg.h"

namespace trn::picture {

/// Deviations around a circle: rings of one round step each inside and outside the circle of no deviation.
class PolarAxes {
 public:
  static constexpr int kRings = 5;  ///< on either side

  /// Where the middle lies; the largest deviation that has to fit, in any unit.
  PolarAxes(Px centre, double peak);

  /// rad from the right, counterclockwise; deviation outwards.
  Px at(double angle_rad, double deviation) const;
  /// Rings with their deviations, spokes with their angles in degrees.
  void draw(Svg& svg, const std::string& unit) const;

  double per_ring() const { return per_ring_; }
  /// From the centre to the outermost text, px.
  static double reach_px();

 private:
  Px on(double angle_rad, double radius_px) const;
  Px centre_;
  double per_ring_;
};

}  // namespace trn::picture
