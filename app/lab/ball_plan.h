#pragma once

#include <vector>

#include "app/session/assembly.h"
#include "compensation/fit/ball_fit.h"
#include "core/frames.h"

namespace trn {

/// How a ball is touched in one position of the rotary axes, as examples/probing/probe_ball.ngc does it.
struct BallTouches {
  Vec3 ball_M = Vec3::Zero();  ///< centre, mm, in machine coordinates with every axis at zero
  double length_mm = 100, tip_mm = 6, diameter_mm = 25;
  double clearance_mm = 15;  ///< between ball and tip before a touch
  int sides = 4;
  double latitude_rad = 0.5235987755982988;  ///< of the touches on the sides, from the equator
  double tilt_max_rad = 1.5707963267948966;  ///< of the tool from the ball's stem, which stands on the table
  double step_rad = 0.2617993877991494;      ///< between the positions that are looked at
};

/// A position of the rotary words, rad, and what it is worth.
struct BallPosition {
  Vec3 abc_rad = Vec3::Zero();
  std::vector<BallContact> contacts;
  double axes_mm = 0;  ///< standard error of the axes with this one too, as BallInformation
};

/// Every position on the grid in which the ball can be touched: within the joints' ranges, also a clearance
/// away from it.
std::vector<BallPosition> ball_positions(const Assembly& assembly, const BallTouches& touches);

/// The next `count` positions, each the one that leaves the least of the axes' mean variance (A-optimal, step
/// by step); they are added to `information`.
std::vector<BallPosition> plan_ball(const std::vector<BallPosition>& positions, int count,
                                    BallInformation& information);

}  // namespace trn
