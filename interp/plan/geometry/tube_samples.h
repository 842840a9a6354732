#pragma once

#include <array>
#include <vector>

#include "interp/plan/lanes.h"

// The sums over a tube's samples, where a fit spends its time: four numbers at once.
namespace trn::tube {

using Four = double __attribute__((vector_size(32), aligned(32)));
using Triple = Four;                    ///< three words, a lane idle
using BandRow = std::array<double, 6>;  ///< row[k] = A(i, i + k)

/// Keeps the alignment in a vector.
struct Point {
  Triple w;
};

/// A sample of the tube as one group of words sees it, the position words or the rotary words.
struct GroupSample {
  Four front, back;            ///< the six basis functions of its span there: four, and two
  Triple middle, target;       ///< as in TubeSample
  Triple deviation{};          ///< of the curve, from the middle
  Triple fit_target;           ///< what a Newton step fits the curve to, in least squares
  double fit_weight = 0;       ///< and with what weight
  double length = 0;           ///< of path that the sample stands for
  double inverse_radius2 = 0;  ///< radius^-2
  size_t span = 0;
};

TRN_VECTOR_INLINE double dot(const Triple& a, const Triple& b) {
  const Triple product = a * b;
  return product[0] + product[1] + product[2];
}

/// Deviations of the curve with these coefficients from the tube's middle, at the samples.
void find_deviations(const std::vector<GroupSample>& samples, const std::vector<Point>& coefficients,
                     std::vector<Point>& deviation);

/// Adds the sum of fit_weight |y - fit_target|^2, times the weight of each sample's span, to the quadratic
/// form y' A y - 2 rhs y, A stored as `band`. Samples of one span lie together.
void add_fit_terms(const std::vector<GroupSample>& samples, const std::vector<double>& weight,
                   std::vector<BandRow>& band, std::vector<Point>& rhs);

}  // namespace trn::tube
