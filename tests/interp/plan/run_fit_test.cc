#include "interp/plan/geometry/run_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/axes.h"
#include "core/frames.h"
#include "core/path.h"
#include "interp/plan/geometry/run_vertex.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

/// Chords of 0.3 mm of a wave.
std::vector<RunVertex> wave(double tolerance_used = 0) {
  std::vector<RunVertex> out;
  double u = 0;
  for (int i = 0; i <= 100; ++i) {
    const Words y = words(0.3 * i, std::sin(0.2 * i), 0, 0.02 * std::sin(0.1 * i));
    if (i > 0) u += run_length(y - out.back().y);
    out.push_back({u, y, tolerance_used});
  }
  return out;
}

RunFit fit(const std::vector<RunVertex>& v, RunEnd start = RunEnd::kPoint, RunEnd end = RunEnd::kPoint) {
  return fit_run({v, start, end, nullptr, 0.02, 0.002});
}

/// Worst deviation over tolerance of the curve from the polyline: at each of 50 places of a span the least
/// over all points of all chords.
double worst_use(const RunFit& f, const std::vector<RunVertex>& v, double mm, double rad) {
  double worst = 0;
  for (int k = 0; k < f.spline.span_count(); ++k) {
    const PathPiece piece =
        make_hermite(f.spline.derivatives_at_break(k), f.spline.derivatives_at_break(k + 1),
                     f.spline.at_break(k + 1) - f.spline.at_break(k));
    for (int i = 0; i <= 50; ++i) {
      const Words y = piece.at(piece.length * i / 50);
      double least = 1e9;
      for (size_t c = 0; c + 1 < v.size(); ++c)
        if (std::abs((v[c].y - y)[kX]) < 1)
          for (int t = 0; t <= 40; ++t) {
            const Words d = y - v[c].y - (v[c + 1].y - v[c].y) * t / 40.0;
            least = std::min(least, std::max(d.head<3>().norm() / mm, d.tail<3>().norm() / rad));
          }
      worst = std::max(worst, least);
    }
  }
  return worst;
}

TEST(RunFit, StaysInTheToleranceAndUsesMuchOfIt) {
  const auto v = wave();
  const RunFit f = fit(v);
  ASSERT_TRUE(f.ok);
  const double used = worst_use(f, v, 0.02, 0.002);
  EXPECT_LE(used, 0.99);
  EXPECT_GT(used, 0.3);
  EXPECT_LT((f.spline.derivatives_at_break(0).y - v.front().y).norm(), 1e-12);
  EXPECT_LT((f.spline.derivatives_at_break(f.spline.span_count()).y - v.back().y).norm(), 1e-12);
}

/// Distance of p from the polyline, mm.
double tip_distance(const Vec3& p, const std::vector<RunVertex>& v) {
  double least = 1e9;
  for (size_t c = 0; c + 1 < v.size(); ++c) {
    const Vec3 a = v[c].y.head<3>(), d = Vec3(v[c + 1].y.head<3>()) - a;
    const double t = std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - t * d).norm());
  }
  return least;
}

/// The greatest distance of the curve's tip from the polyline, at 400 places of each span, mm.
double worst_tip_distance(const RunFit& f, const std::vector<RunVertex>& v) {
  double worst = 0;
  for (int k = 0; k < f.spline.span_count(); ++k) {
    const PathPiece piece =
        make_hermite(f.spline.derivatives_at_break(k), f.spline.derivatives_at_break(k + 1),
                     f.spline.at_break(k + 1) - f.spline.at_break(k));
    for (int i = 0; i < 400; ++i)
      worst = std::max(worst, tip_distance(piece.at(piece.length * i / 400).head<3>(), v));
  }
  return worst;
}

// Long chords beside each other: between their ends, too, the curve is looked at.
TEST(RunFit, AcceptedCurvesStayInTheToleranceBesideLongChords) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> part(-1, 1);
  int accepted = 0;
  for (int round = 0; round < 400; ++round) {
    std::vector<RunVertex> v;
    double u = 0, way = 0;
    const double tolerance_mm = std::pow(10, 0.7 * part(rng) - 1.5);
    const double bend = 0.1 * part(rng) * std::sqrt(tolerance_mm / 0.03);  // of a polygon with such tolerance
    for (int i = 0, n = 8 + static_cast<int>(10 * (1 + part(rng))); i < n; ++i) {
      way += bend * (1 + 0.3 * part(rng));
      Words y = v.empty() ? words(0, 0) : v.back().y;
      const double length = 2 + part(rng);
      y[kX] += length * std::cos(way);
      y[kY] += length * std::sin(way);
      if (!v.empty()) u += run_length(y - v.back().y);
      v.push_back({u, y, 0});
    }
    const RunFit f = fit_run({v, RunEnd::kPoint, RunEnd::kPoint, nullptr, tolerance_mm, 9e-4});
    if (!f.ok) continue;
    ++accepted;
    const double worst = worst_tip_distance(f, v);
    EXPECT_LE(worst, 0.982 * tolerance_mm) << "round " << round;
    double told = 0;
    for (const TubeUse& use : f.usage) told = std::max(told, use.worst());
    if (worst > 0.95 * tolerance_mm) {  // below that it is not looked at more closely
      EXPECT_GE(told * tolerance_mm, 0.99 * worst) << "round " << round;
    }
  }
  EXPECT_GT(accepted, 200);
}

/// A few five-axis moves as CAM writes them: of very different lengths, rounded to four digits.
std::vector<RunVertex> few_moves(std::mt19937_64& rng) {
  std::uniform_real_distribution<double> part(-1, 1);
  std::vector<RunVertex> out{{0, Words::Zero(), 0}};
  Vec3 step(0.2 + 0.1 * part(rng), 0.2 * part(rng), 0.1 * part(rng));
  double tilt = 0.015 * part(rng), u = 0;
  const int count = 4 + static_cast<int>(2 * (1 + part(rng)));
  for (int i = 0; i < count; ++i) {
    step += 0.03 * Vec3(part(rng), part(rng), part(rng));
    tilt += 0.002 * part(rng);
    Words y = out.back().y;
    y.head<3>() += (1e4 * step * std::pow(2, part(rng))).array().round().matrix() / 1e4;
    y[kA] += tilt;
    u += run_length(y - out.back().y);
    out.push_back({u, y, 0});
  }
  return out;
}

// Where a vertex lies just beside a break, the greatest deviation is a peak much narrower than a span.
TEST(RunFit, AcceptedCurvesOfFewMovesStayInAnyTolerance) {
  std::mt19937_64 rng(1);
  int accepted = 0;
  for (int round = 0; round < 300; ++round) {
    const auto v = few_moves(rng);
    const double tolerance_mm = std::pow(10, std::uniform_real_distribution<double>(-3.5, -1.5)(rng));
    const RunFit f = fit_run({v, RunEnd::kPoint, RunEnd::kPoint, nullptr, tolerance_mm, 9e-4});
    if (!f.ok) continue;
    ++accepted;
    const double worst = worst_tip_distance(f, v);
    EXPECT_LE(worst, 0.982 * tolerance_mm) << "round " << round;
  }
  EXPECT_GT(accepted, 200);
}

// What chords themselves may be off the program is taken from the tolerance.
TEST(RunFit, AToleranceThatIsUsedAlreadyIsLeftAlone) {
  const auto v = wave(0.5);
  const RunFit f = fit(v);
  ASSERT_TRUE(f.ok);
  EXPECT_LE(worst_use(f, v, 0.02, 0.002), 0.5);
}

TEST(RunFit, StartsAndEndsOnALineWithThreeDerivatives) {
  const auto v = wave();
  const RunFit f = fit(v, RunEnd::kOnLine, RunEnd::kOnLine);
  ASSERT_TRUE(f.ok);
  const PathPoint first = f.spline.derivatives_at_break(0),
                  last = f.spline.derivatives_at_break(f.spline.span_count());
  EXPECT_LT((first.d1 - (v[1].y - v[0].y) / v[1].u).norm(), 1e-9);
  EXPECT_LT((last.d1 - (v[100].y - v[99].y) / (v[100].u - v[99].u)).norm(), 1e-9);
  for (const PathPoint& p : {first, last}) EXPECT_LT(p.d2.norm() + p.d3.norm(), 1e-6);
}

// Beside a corner that a blend will round, the curve keeps to the chord.
TEST(RunFit, ACornerGetsLittleOfTheTolerance) {
  const auto v = wave();
  const RunFit f = fit(v, RunEnd::kCorner, RunEnd::kPoint);
  ASSERT_TRUE(f.ok);
  const PathPiece piece =
      make_hermite(f.spline.derivatives_at_break(0), f.spline.derivatives_at_break(1), f.spline.at_break(1));
  const Vec3 along = (v[1].y - v[0].y).head<3>().normalized();
  for (int i = 0; i <= 20; ++i) {
    const double u = std::min(0.05, piece.length) * i / 20;
    const Vec3 d = (piece.at(u) - v[0].y).head<3>();
    EXPECT_LT((d - along * along.dot(d)).norm(), 0.2 * 0.02);
  }
}

// A bump of a few chords, which spans that suit the rest cannot follow: they are refined there, from either
// end alike.
TEST(RunFit, ARunBackwardsIsRefinedAtTheSamePlaces) {
  std::vector<RunVertex> v;
  for (int i = 0; i <= 100; ++i) {
    const double bump = 0.12 * std::exp(-0.5 * std::pow((i - 40) / 1.1, 2)), x = 0.3 * i;
    const Words y = words(x, bump + 0.004 * std::sin(40 * x));
    v.push_back({v.empty() ? 0 : v.back().u + run_length(y - v.back().y), y, 0});
  }
  std::vector<RunVertex> back(v.rbegin(), v.rend());
  for (RunVertex& vertex : back) vertex.u = v.back().u - vertex.u;
  const RunFit there = fit_run({v, RunEnd::kPoint, RunEnd::kPoint, nullptr, 0.005, 0.002}),
               again = fit_run({back, RunEnd::kPoint, RunEnd::kPoint, nullptr, 0.005, 0.002});
  ASSERT_TRUE(there.ok);
  ASSERT_TRUE(again.ok);
  ASSERT_EQ(there.spline.span_count(), again.spline.span_count());
  for (int k = 0; k <= there.spline.span_count(); ++k)
    EXPECT_NEAR(there.spline.at_break(k), v.back().u - again.spline.at_break(there.spline.span_count() - k),
                1e-3);
}

TEST(RunFit, WhatNoCurveFitsIsReportedWithItsPlace) {
  std::vector<RunVertex> v;
  for (int i = 0; i <= 20; ++i) v.push_back({0.3 * i, words(0.3 * i, i == 12 ? 0.5 : 0), 0});
  const RunFit f = fit_run({v, RunEnd::kPoint, RunEnd::kPoint, nullptr, 1e-4, 1e-4});
  EXPECT_FALSE(f.ok);
  EXPECT_NEAR(static_cast<double>(f.worst_vertex), 12, 2);
}

}  // namespace
}  // namespace trn::geometry_check
