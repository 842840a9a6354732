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
  size_t span = 0;            ///< set by locate_samples
  std::array<double, 6> row;  ///< set by locate_samples: the basis functions of the span at u
};

/// Finds each sample's span and basis functions; samples ascend in u.
void locate_samples(const QuinticSpline& spline, std::vector<SplineSample>& samples);

/// The spline at a located sample.
Words value_at(const QuinticSpline& spline, const SplineSample& sample);

/// The linear problem of fitting: minimises sum weight |y(u) - sample|^2 + integral (smoothing h)^6 |y'''|^2
/// (h: local span) over the coefficients from `fixed_head` to the one before the last `fixed_tail`; the
/// others keep their values. Assembled and factorised once, solved for as many sets of sample values as are
/// wanted.
class SplineProblem {
 public:
  SplineProblem(const QuinticSpline& spline, const std::vector<SplineSample>& samples, double smoothing,
                int fixed_head, int fixed_tail);

  /// Coefficients for the samples' present values; places and weights as at construction.
  void solve(const std::vector<SplineSample>& samples, QuinticSpline& spline);

 private:
  using Row = std::array<double, 6>;

  void add(size_t first, const Row& row, double weight);
  void add_penalty(const QuinticSpline& spline, double smoothing);
  void move_fixed_to_rhs(const QuinticSpline& spline);
  void factorise();

  size_t from_ = 0, to_ = 0;      ///< free coefficients
  std::vector<Row> band_;         ///< symmetric: band_[i][k] = A(i, i + k); then L' and D
  std::vector<double> inverse_;   ///< of D
  std::vector<Words> fixed_rhs_;  ///< what the fixed coefficients contribute
  std::vector<Words> rhs_;
};

}  // namespace trn
