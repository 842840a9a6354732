#include "interp/plan/geometry/run_target.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "interp/plan/geometry/run_vertex.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

/// Vertices of (u, y(u)); u counts as it stands.
template <typename Function>
std::vector<RunVertex> vertices(const Function& y, double step) {
  std::vector<RunVertex> out;
  for (int i = 0; i < 12; ++i) {
    const double u = step * i;
    out.push_back({u, words(u, y(u)), 0});
  }
  return out;
}

// Slopes of fourth order make the cubic exact, away from the run's ends.
TEST(RunTarget, ReproducesACubicFromItsChords) {
  const auto cubic = [](double u) { return 0.01 * u * u * u - 0.05 * u * u + 0.2 * u; };
  const auto v = vertices(cubic, 0.5);
  const RunTarget target(v, 1, 1);
  for (size_t chord = 2; chord + 3 < v.size(); ++chord)
    for (const double part : {0.0, 0.25, 0.5, 0.9, 1.0}) {
      const double u = v[chord].u + part * (v[chord + 1].u - v[chord].u);
      EXPECT_LT((target.at(chord, part) - words(u, cubic(u))).norm(), 1e-13);
    }
}

// In the middle of a chord the sag is the distance to it.
TEST(RunTarget, SagIsTheDeviationFromTheChordAcrossThePath) {
  const auto circle = [](double u) { return std::sqrt(400 - (u - 3) * (u - 3)); };
  const auto v = vertices(circle, 0.5);
  const RunTarget target(v, 1, 1);
  for (size_t chord = 2; chord + 3 < v.size(); ++chord) {
    const double h = (v[chord + 1].y - v[chord].y).norm();
    EXPECT_NEAR(target.sag(chord, 0.5).norm(), 20 - std::sqrt(400 - h * h / 4), 2e-3 * h * h / 160);
  }
}

// A corner is no sample of a curve: at most half the tolerance is left of its sag.
TEST(RunTarget, SagIsAtMostHalfTheTolerance) {
  std::vector<RunVertex> v;
  for (int i = 0; i < 9; ++i) v.push_back({1.0 * i, words(i, i < 5 ? 0 : 0.8 * (i - 4)), 0});
  const RunTarget target(v, 0.02, 1);
  double greatest = 0;
  for (size_t chord = 0; chord + 1 < v.size(); ++chord) {
    const Words middle = (v[chord].y + v[chord + 1].y) / 2, slope = v[chord + 1].y - v[chord].y;
    Words off = target.at(chord, 0.5) - middle;
    off -= slope * slope.dot(off) / slope.squaredNorm();
    greatest = std::max(greatest, off.norm());
    EXPECT_LT((target.at(chord, 0) - v[chord].y).norm(), 1e-15);
    EXPECT_LT((target.at(chord, 1) - v[chord + 1].y).norm(), 1e-15);
  }
  EXPECT_NEAR(greatest, 0.01, 1e-9);
}

// Where the length along the run is counted from does not matter, also where the change of slope is bounded.
TEST(RunTarget, KnowsDistancesOnly) {
  std::vector<RunVertex> near, far;
  for (int i = 0; i < 9; ++i) {
    near.push_back({1.0 * i, words(i, i % 2 ? 1.5 : 0), 0});
    far.push_back({1000.0 + i, near.back().y, 0});
  }
  const RunTarget a(near, 100, 1), b(far, 100, 1);
  for (size_t chord = 0; chord + 1 < near.size(); ++chord)
    for (const double part : {0.2, 0.5, 0.7})
      EXPECT_LT((a.at(chord, part) - b.at(chord, part)).norm(), 1e-12) << chord;
}

}  // namespace
}  // namespace trn::geometry_check
