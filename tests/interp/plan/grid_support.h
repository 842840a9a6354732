#pragma once

#include <deque>
#include <functional>

#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/path_sampler.h"
#include "tests/interp/plan/speed_support.h"

// Grids in closed form, for tests of the units behind PathGrid.
namespace trn::speed_test {

/// Derivatives of the joints and the bound on (ds/dt)^2 at s.
using SampleFunction = std::function<speed::PathSample(double s)>;

/// Intervals of the lengths `h`, `parts` + 1 samples in each.
inline std::deque<speed::GridInterval> make_grid(const std::vector<double>& h, const SampleFunction& at,
                                                 double jerk_bound = 1e5, int parts = 2) {
  std::deque<speed::GridInterval> grid;
  double s = 0;
  for (const double length : h) {
    speed::GridInterval g;
    g.s = s;
    g.h = length;
    g.bound = {1e6, 5000, jerk_bound};
    for (int i = 0; i <= parts; ++i) {
      const double here = s + length * i / parts;
      g.samples.push_back(at(here));
      g.samples.back().s = here;
    }
    grid.push_back(std::move(g));
    s += length;
  }
  return grid;
}

/// One joint that follows the path: q = s.
inline speed::PathSample straight_sample(double b_max) {
  speed::PathSample p;
  p.b_max = b_max;
  p.d1[0] = 1;
  return p;
}

}  // namespace trn::speed_test
