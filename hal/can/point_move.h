#pragma once

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/realtime.h"

namespace trn {

/// A move to a place by a trapezoid of speed, a step a period. mm or rad, s. Pure.
class PointMove {
 public:
  struct Limits {
    double speed = 0, acceleration = 0, period_s = 0.001;
  };

  void begin(double place) TRN_RT {
    place_ = place;
    speed_ = 0;
  }
  /// One period towards `goal`; true when it is there.
  bool step(double goal, const Limits& limits) TRN_RT {
    TRN_CHECK(limits.speed > 0 && limits.acceleration > 0);
    const double way = goal - place_, dt = limits.period_s, a = limits.acceleration;
    // The speed from which the way that is left is just enough to stop: v^2 = 2 a s.
    const double wanted = std::copysign(std::min(limits.speed, std::sqrt(2 * a * std::abs(way))), way);
    speed_ += std::clamp(wanted - speed_, -a * dt, a * dt);
    const double step = speed_ * dt;
    const bool there = std::abs(way) <= std::abs(step) || std::abs(way) < 1e-9;
    place_ = there ? goal : place_ + step;
    if (there) speed_ = 0;
    return there;
  }
  double place() const TRN_RT { return place_; }
  double speed() const TRN_RT { return speed_; }

 private:
  double place_ = 0, speed_ = 0;
};

}  // namespace trn
