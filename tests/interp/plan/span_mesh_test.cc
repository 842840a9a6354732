#include "interp/plan/geometry/span_mesh.h"

#include <gtest/gtest.h>

#include <functional>

#include "core/axes.h"
#include "core/units.h"
#include "interp/plan/geometry/run_target.h"
#include "interp/plan/geometry/run_vertex.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

std::vector<RunVertex> polyline(double length, double chord, const std::function<double(double)>& y) {
  std::vector<RunVertex> out;
  const int n = static_cast<int>(length / chord + 0.5);
  double u = 0;
  for (int i = 0; i <= n; ++i) {
    const Words at = words(length * i / n, y(length * i / n));
    if (i > 0) u += run_length(at - out.back().y);
    out.push_back({u, at, 0});
  }
  return out;
}

std::vector<double> mesh(const std::vector<RunVertex>& v, std::vector<SpanLimit> limits = {}) {
  const RunTarget target(v, 0.01, 0.01);
  return mesh_breaks({target, v.front().u, v.back().u, 0.01, 0.01, std::move(limits)});
}

double longest(const std::vector<double>& breaks, double from = -1e9, double to = 1e9) {
  double out = 0;
  for (size_t i = 1; i < breaks.size(); ++i)
    if (breaks[i] > from && breaks[i - 1] < to) out = std::max(out, breaks[i] - breaks[i - 1]);
  return out;
}

double straight(double) { return 0; }

// A straight run needs the longest spans: 4 mm over 1.6, and a sixth of a short run over 1.6.
TEST(SpanMesh, SpansOfAStraightRunAreTheLongest) {
  const auto long_run = mesh(polyline(200, 0.5, straight)), short_run = mesh(polyline(3, 0.5, straight));
  EXPECT_EQ(long_run.front(), 0);
  EXPECT_NEAR(long_run.back(), 200, 1e-9);
  EXPECT_NEAR(longest(long_run), 4 / 1.6, 1e-9);
  EXPECT_NEAR(longest(short_run), 3 / 6.0 / 1.6, 0.02);
  EXPECT_GE(short_run.size(), 10u) << "6 spans times 1.6, however short the run";
}

TEST(SpanMesh, ALimitHoldsAndSpansGrowByThreeTenthsOfTheDistance) {
  const auto breaks = mesh(polyline(100, 0.5, straight), {{50, 0.1}});
  for (size_t i = 1; i < breaks.size(); ++i) {
    const double middle = (breaks[i] + breaks[i - 1]) / 2, distance = std::abs(middle - 50);
    EXPECT_LE((breaks[i] - breaks[i - 1]) * 1.6, 1.3 * (0.1 + 0.3 * distance)) << middle;
  }
  EXPECT_LT(longest(breaks, 49.99, 50.01), 0.1);
  EXPECT_NEAR(longest(breaks), 4 / 1.6, 0.05);
}

// Where the run waves, spans are short enough that a sixth difference at their step is a tenth of the
// tolerance.
TEST(SpanMesh, WavesGetSpansThatCanFollowThem) {
  const auto wave = [](double x) { return 0.3 * std::sin(2 * kPi * x / 5.3); };
  const auto breaks = mesh(polyline(60, 0.05, wave));
  const auto span = [](double amplitude, double w) {  // (2 sin(w h / 2))^6 amplitude / 60 = 0.1 * 0.01
    return 2 / w * std::asin(std::pow(0.06 / amplitude, 1.0 / 6) / 2);
  };
  const double needed = span(0.3, 2 * kPi / 5.3);
  EXPECT_LT(longest(breaks, 10, 50) * 1.6, 1.3 * needed);
  EXPECT_GT(longest(breaks, 10, 50) * 1.6, 0.7 * needed);
}

TEST(SpanMesh, ARunBackwardsHasTheSameBreaks) {
  auto v = polyline(40, 0.2, [](double x) { return 0.02 * x * std::sin(x); });
  const auto there = mesh(v);
  const double end = v.back().u;
  std::reverse(v.begin(), v.end());
  for (RunVertex& vertex : v) vertex.u = end - vertex.u;
  const auto back = mesh(v);
  ASSERT_EQ(there.size(), back.size());
  for (size_t i = 0; i < there.size(); ++i) EXPECT_NEAR(there[i], end - back[back.size() - 1 - i], 1e-6);
}

// Where the machine's zero lies does not matter.
TEST(SpanMesh, ARunFarAwayHasTheSameBreaks) {
  const auto near = polyline(40, 0.2, [](double x) { return 0.5 * x * std::sin(x); });
  auto far = near;
  for (RunVertex& vertex : far) vertex.y += words(-20, 300, 50);
  const auto there = mesh(near), away = mesh(far);
  ASSERT_EQ(there.size(), away.size());
  for (size_t i = 0; i < there.size(); ++i) EXPECT_NEAR(there[i], away[i], 1e-6);
}

}  // namespace
}  // namespace trn::geometry_check
