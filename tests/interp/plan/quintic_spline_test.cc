#include "interp/plan/geometry/quintic_spline.h"

#include <gtest/gtest.h>

#include <random>

#include "core/axes.h"
#include "core/path.h"

namespace trn {
namespace {

QuinticSpline random_spline(unsigned seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> u(0.5, 1.5);
  QuinticSpline s;
  s.knots.assign(6, 0.0);
  for (int i = 0; i < 5; ++i) s.knots.push_back(s.knots.back() + u(rng));
  s.knots.insert(s.knots.end(), 5, s.knots.back());
  for (size_t i = 0; i + 6 < s.knots.size(); ++i) s.coefficients.push_back(Words::Random());
  return s;
}

Words value(const QuinticSpline& s, size_t span, double u) {
  const auto row = basis_row(s, span, u);
  Words y = Words::Zero();
  for (size_t i = 0; i < 6; ++i) y += row[i] * s.coefficients[span + i];
  return y;
}

TEST(QuinticSpline, BasisIsPositiveAndSumsToOne) {
  const QuinticSpline s = random_spline(1);
  for (size_t k = 0; k < static_cast<size_t>(s.span_count()); ++k)
    for (int i = 0; i <= 10; ++i) {
      double sum = 0;
      for (const double b : basis_row(s, k, s.knots[k + 5] + (s.knots[k + 6] - s.knots[k + 5]) * i / 10)) {
        EXPECT_GE(b, -1e-15);
        sum += b;
      }
      EXPECT_NEAR(sum, 1, 1e-14);
    }
}

// Marsden: with the means of five inner knots as coefficients the spline is u itself.
TEST(QuinticSpline, ReproducesALine) {
  QuinticSpline s = random_spline(2);
  for (size_t i = 0; i < s.coefficients.size(); ++i)
    s.coefficients[i].setConstant(
        (s.knots[i + 1] + s.knots[i + 2] + s.knots[i + 3] + s.knots[i + 4] + s.knots[i + 5]) / 5);
  for (size_t k = 0; k < static_cast<size_t>(s.span_count()); ++k) {
    const double u = 0.3 * s.knots[k + 5] + 0.7 * s.knots[k + 6];
    EXPECT_NEAR(value(s, k, u)[0], u, 1e-14);
  }
}

// Derivatives at a break against differences of the values, from either side: four are continuous.
TEST(QuinticSpline, DerivativesAtABreakAreThoseOfBothSpans) {
  const QuinticSpline s = random_spline(3);
  for (int i = 0; i <= s.span_count(); ++i) {
    const PathPoint p = s.derivatives_at_break(i);
    const double u = s.at_break(i), h = 0.02;
    for (const int side : {-1, 0}) {
      const int span = i + side;
      if (span < 0 || span >= s.span_count()) continue;
      const auto at = [&](double d) { return value(s, static_cast<size_t>(span), u + d); };
      const Words m3 = at(-3 * h), m2 = at(-2 * h), m1 = at(-h), p1 = at(h), p2 = at(2 * h), p3 = at(3 * h);
      EXPECT_LT((p.y - at(0)).norm(), 1e-13);
      EXPECT_LT((p.d1 - (-m3 + 9 * m2 - 45 * m1 + 45 * p1 - 9 * p2 + p3) / (60 * h)).norm(), 1e-11);
      EXPECT_LT(
          (p.d2 - (2 * m3 - 27 * m2 + 270 * m1 - 490 * at(0) + 270 * p1 - 27 * p2 + 2 * p3) / (180 * h * h))
              .norm(),
          1e-9);
      EXPECT_LT((p.d3 - (m3 - 8 * m2 + 13 * m1 - 13 * p1 + 8 * p2 - p3) / (8 * h * h * h)).norm(), 1e-7);
    }
  }
}

}  // namespace
}  // namespace trn
