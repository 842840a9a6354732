#pragma once

#include <array>
#include <vector>

#include "core/axes.h"
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

/// The basis functions that live on the span, at u: value of the spline = row times coefficients span .. span
/// + 5.
std::array<double, 6> basis_row(const QuinticSpline& spline, size_t span, double u);

}  // namespace trn
