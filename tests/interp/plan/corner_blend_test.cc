#include "interp/plan/geometry/corner_blend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/move.h"
#include "interp/plan/geometry/path_item.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

PathItem item(const PathPiece& piece, double tol_mm = 0.05, double tol_rad = 0.01) {
  PathItem i;
  i.piece = piece;
  i.tolerance_mm = tol_mm;
  i.tolerance_rad = tol_rad;
  return i;
}

PathItem line(const Words& from, const Words& to, double tol_mm = 0.05) {
  return item(make_line(from, to), tol_mm);
}

PathPiece quarter_arc() {
  return make_arc(words(10, 0), words(0, 10), Vec3(0, 0, 0), Vec3(0, 0, 1), kPi / 2);
}

/// Worst deviation over tolerance at equal parameters, at 20000 places.
double brute_usage(const PathPiece& before, const PathPiece& after, double span, double mm, double rad) {
  const PathPiece blend = make_blend(before, after, span);
  double worst = 0;
  for (int i = 0; i <= 20000; ++i) {
    const double s = 2 * span * i / 20000;
    const Words d = blend.at(s) - (s <= span ? before.at(before.length - span + s) : after.at(s - span));
    worst = std::max({worst, d.head<3>().norm() / mm, d.tail<3>().norm() / rad});
  }
  return worst;
}

// The constant of P1, by integrating the quintic smoothstep: twice its integral over the first half.
TEST(CornerBlend, MissesTheCornerOfTwoLinesAsTheSmoothstepSays) {
  double sum = 0;
  for (int i = 0; i < 100000; ++i) {
    const double u = (i + 0.5) / 200000;
    sum += u * u * u * (10 - 15 * u + 6 * u * u) / 200000;
  }
  EXPECT_NEAR(kCornerMiss, 2 * sum, 1e-9);
  const PathPiece a = make_line(words(-10, 0), words(0, 0)), b = make_line(words(0, 0), words(3, 9));
  const double used = blend_usage(a, b, 0.8, {0.05, 1, 5});
  EXPECT_NEAR(used, brute_usage(a, b, 0.8, 0.05, 1), 1e-6);
}

TEST(CornerBlend, UsageIsTheWorstOfAllPlaces) {
  const PathPiece arc = quarter_arc();
  for (const Words& to : {words(-5, 10), words(4, 18), words(0, 14, 6, 0.3)})
    for (const double span : {0.3, 1.0, 2.5}) {
      const PathPiece after = make_line(words(0, 10), to);
      const double truth = brute_usage(arc, after, span, 0.05, 0.02);
      const double used = blend_usage(arc, after, span, {0.05, 0.02, 5});
      if (truth < 1e-6) continue;
      EXPECT_GE(used, 0.9999 * truth);
      EXPECT_LE(used, 1.002 * truth);
    }
}

// Two arcs that run into each other, either bent the same way or like an S: the worst place lies on either
// side of where they meet, and between the samples as a rule.
TEST(CornerBlend, UsageIsTheWorstBetweenTheSamplesToo) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> size(1, 20), turn(0.2, 1.5);
  for (int round = 0; round < 100; ++round) {
    const double r1 = size(rng), r2 = size(rng), phi = turn(rng), psi = turn(rng), side = round % 2 ? 1 : -1;
    const PathPiece before = make_arc(words(-r1 * std::sin(phi), r1 * (1 - std::cos(phi))), words(0, 0),
                                      Vec3(0, r1, 0), Vec3(0, 0, 1), phi);
    const PathPiece after = make_arc(words(0, 0), words(r2 * std::sin(psi), side * r2 * (1 - std::cos(psi))),
                                     Vec3(0, side * r2, 0), Vec3(0, 0, side), psi);
    const double span = std::min(before.length, after.length) * turn(rng) / 3;
    const double truth = brute_usage(before, after, span, 0.05, 0.02);
    const double used = blend_usage(before, after, span, {0.05, 0.02, 50});
    EXPECT_GE(used, 0.99999 * truth) << round;
    EXPECT_LE(used, 1.002 * truth) << round;
  }
}

// The largest span keeps the tolerance and one hardly larger does not.
TEST(CornerBlend, TheLargestSpanUsesTheWholeTolerance) {
  const PathPiece arc = quarter_arc(), a = make_line(words(0, -9), words(0, 0));
  const PathPiece b = make_line(words(0, 0), words(7, 2)), c = make_line(words(0, 10), words(4, 18));
  for (const auto& [before, after] : {std::pair(a, b), std::pair(arc, c)}) {
    const double span = largest_span(before, after, {0.02, 0.01, 6});
    ASSERT_GT(span, 0.01);
    ASSERT_LT(span, 6);
    EXPECT_LE(brute_usage(before, after, span, 0.02, 0.01), 1.0001);
    EXPECT_GT(brute_usage(before, after, 1.01 * span, 0.02, 0.01), 1);
  }
  EXPECT_EQ(largest_span(a, b, {1e3, 1, 0.7}), 0.7) << "the bound on the span";
  EXPECT_EQ(largest_span(a, b, {0, 1, 0.7}), 0) << "no tolerance, no blend";
}

TEST(CornerBlend, BothItemsToleranceCounts) {
  const Words o = words(0, 0), x = words(10, 0), y = words(10, 10);
  const double wide = classify(line(o, x, 0.04), line(x, y, 0.04)).span;
  EXPECT_NEAR(classify(line(o, x, 0.01), line(x, y, 0.04)).span, wide / 4, 1e-9);
  EXPECT_NEAR(classify(line(o, x, 0.04), line(x, y, 0.01)).span, wide / 4, 1e-9);
}

TEST(CornerBlend, JunctionsAreClassified) {
  using Kind = Junction::Kind;
  const Words o = words(0, 0), x = words(10, 0);
  const auto kind = [&](PathItem a, PathItem b) { return classify(a, b).kind; };
  EXPECT_EQ(kind(line(o, x), line(x, words(20, 0))), Kind::kSmooth);
  EXPECT_EQ(kind(line(o, x), line(x, words(20, 5))), Kind::kBlend);
  EXPECT_EQ(kind(line(o, x), line(x, words(0, 0.4))), Kind::kStop) << "turns by more than 175 degrees";
  EXPECT_EQ(kind(line(o, x), line(x, words(0, 3))), Kind::kBlend);
  EXPECT_EQ(kind(line(o, x, 0), line(x, words(20, 5), 0)), Kind::kStop) << "no tolerance";
  PathItem a = line(o, x), b = line(x, words(20, 0));
  a.mode = b.mode = PathMode::kExactPath;
  EXPECT_EQ(kind(a, b), Kind::kSmooth);
  a.mode = b.mode = PathMode::kExactStop;
  EXPECT_EQ(kind(a, b), Kind::kStop);
  PathItem bend = line(o, x);
  bend.joins_next = true;
  EXPECT_EQ(kind(bend, line(x, words(20, 5))), Kind::kSmooth) << "by construction";
}

// Every part of the context means another motion of the joints: the machine stops in between.
TEST(CornerBlend, AChangeOfContextIsAStop) {
  using Kind = Junction::Kind;
  const PathItem a = line(words(0, 0), words(10, 0));
  const auto kind = [&](const std::function<void(MapContext&)>& change) {
    PathItem b = line(words(10, 0), words(20, 0));
    change(b.context);
    return classify(a, b).kind;
  };
  EXPECT_EQ(kind([](MapContext&) {}), Kind::kSmooth);
  EXPECT_EQ(kind([](MapContext& c) { c.rtcp = true; }), Kind::kStop);
  EXPECT_EQ(kind([](MapContext& c) { c.tool_offset[2] = 1; }), Kind::kStop);
  EXPECT_EQ(kind([](MapContext& c) { c.X_WB.p[0] = 1; }), Kind::kStop);
  EXPECT_EQ(kind([](MapContext& c) { c.corrections_off = kJointTableBit; }), Kind::kStop);
}

}  // namespace
}  // namespace trn::geometry_check
