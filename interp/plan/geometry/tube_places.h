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

/// A sample as the position words or the rotary words see it.
struct Place {
  Four front, back;  ///< the functions of its span there: four, and two
  Triple middle, target;
  Triple off{};             ///< the curve, from the middle
  Triple aim;               ///< what a step draws the curve to
  double pull = 0;          ///< how strongly
  double length = 0;        ///< of path
  double radius_power = 0;  ///< radius^-2
  size_t span = 0;
};

TRN_VECTOR_INLINE double dot(const Triple& a, const Triple& b) {
  const Triple product = a * b;
  return product[0] + product[1] + product[2];
}

/// The curve with these coefficients at the places, from the tube's middle.
void find_off(const std::vector<Place>& places, const std::vector<Point>& coefficients,
              std::vector<Point>& off);

/// Adds the sum of pull * |y - aim|^2, times the weight of the place's span, to the quadratic form.
void add_pulls(const std::vector<Place>& places, const std::vector<double>& weight,
               std::vector<BandRow>& band, std::vector<Point>& rhs);

}  // namespace trn::tube
