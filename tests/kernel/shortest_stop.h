#pragma once

#include <vector>

#include "core/axes.h"
#include "tests/kernel/planned_motion.h"

namespace trn {

/// The shortest time in which a planned motion can come to rest on its own path, every joint's velocity,
/// acceleration and jerk inside its limits: dynamic programming over plan time, rate r and slope w = r'. It
/// knows the plan by samples of the joints alone and shares nothing with PathRate.
///
/// By plan time, with b = r^2, b' = 2 w and w' = c = r''/r: between two samples c is constant, so b is a
/// parabola, and the joints leave an interval of c,
///   |j b + 3 a w + v c| <= J / r  in the middle,   |a b + v w| <= A,  |v r| <= V  at the end.
/// The value is the least time to rest; bilinear between the nodes of (r, w).
class ShortestStop {
 public:
  struct Grid {
    double step_s = 5e-4;  ///< of plan time
    int rates = 101, slopes = 161;
    int pushes = 11;  ///< tried at a node, over the interval of c
    double slope_max = 120;
    double rate_min = 0.05, rate_max = 1.05;
  };

  /// `reach_s`: plan time ahead that is looked at.
  ShortestStop(const PlannedMotion& motion, double plan_time_s, double reach_s, const Grid& grid);

  /// Time to rest from this rate and slope at the beginning, s, driven step by step as the values say: every
  /// limit is kept, so the shortest stop takes no longer. Infinite if the grid finds none.
  double driven(double rate, double slope) const;

 private:
  /// What the joints do at rate 1.
  struct Row {
    JointVec v, a, j;       ///< in the middle of a step
    JointVec v_end, a_end;  ///< at its end
  };
  struct Range {
    double low, high;
  };
  struct State {
    double rate, slope, time_s;
  };

  void sample(const PlannedMotion& motion, double plan_time_s, double reach_s);
  void solve();
  Range pushes(int step, double rate, double slope) const;
  State go(double rate, double slope, double c) const;
  double best(int step, double rate, double slope, int tries, double* c_best) const;
  double at(int step, double rate, double slope) const;
  double last_stretch(int step, double rate, double slope) const;
  double rate_at(int m) const { return grid_.rate_min + rate_width_ * m; }
  double slope_at(int n) const;
  double slope_index(double slope) const;

  Grid grid_;
  Joints joints_;
  bool rests_ = false;  ///< the plan itself is at rest at the end of the reach
  double rate_width_, slope_width_;
  int slopes_down_;
  std::vector<Row> rows_;
  std::vector<std::vector<float>> value_;
};

}  // namespace trn
