#pragma once

#include <array>
#include <vector>

#include "core/path.h"

namespace trn {

/// Quintic B-spline of the six words with simple inner knots: four continuous derivatives. Span k lies
/// between knots 5 + k and 6 + k and depends on coefficients k .. k + 5.
struct QuinticSpline {
  std::vector<double> knots;        ///< span count + 11
  std::vector<Words> coefficients;  ///< span count + 5

  int span_count() const { return static_cast<int>(knots.size()) - 11; }
  double at_break(int i) const { return knots[static_cast<size_t>(5 + i)]; }
  /// Value and derivatives at the break before span i (i = span count: at the end).
  PathPoint derivatives_at_break(int i) const;
};

/// One place that the spline should come near.
struct SplineSample {
  double u = 0;
  double weight = 0;  ///< length of path that it stands for
  Words y;
};

/// Minimises sum weight |y(u) - sample|^2 + integral (rho h)^6 |y'''|^2 over the coefficients from
/// `fixed_head` to the one before the last `fixed_tail`; the others keep their values. h is the local span,
/// samples ascend in u.
void fit_coefficients(QuinticSpline& spline, const std::vector<SplineSample>& samples, int fixed_head,
                      int fixed_tail);

}  // namespace trn
