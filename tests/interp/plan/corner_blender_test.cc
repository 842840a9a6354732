#include "interp/plan/geometry/corner_blender.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/frames.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/plan/geometry/path_item.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn::geometry_check {
namespace {

PathItem line(const Words& from, const Words& to, double tol_mm, std::uint32_t number = 0) {
  PathItem i;
  i.piece = make_line(from, to);
  i.tolerance_mm = tol_mm;
  i.tolerance_rad = 0.01;
  i.source.line = i.last_source.line = number;
  return i;
}

std::vector<PlanPiece> blend(const std::vector<PathItem>& items) {
  Collector out;
  CornerBlender blender(out);
  for (const PathItem& i : items) blender.add(i);
  blender.stop();
  return out.pieces;
}

/// Least distance of a point to the pieces' path.
double distance(const std::vector<PlanPiece>& pieces, const Words& point) {
  double least = 1e30;
  for (const PlanPiece& p : pieces)
    for (int i = 0; i <= 4000; ++i)
      least = std::min(least, (p.piece.at(p.piece.length * i / 4000) - point).norm());
  return least;
}

// Short items share their length among their two blends, so the span is searched again, under both
// tolerances.
TEST(CornerBlender, TheStricterToleranceHoldsAtEveryCorner) {
  for (const bool strict_first : {true, false}) {
    const double first = strict_first ? 0.01 : 0.2, second = strict_first ? 0.2 : 0.01;
    const auto pieces =
        blend({line(words(0, 0), words(0.8, 0), first), line(words(0.8, 0), words(0.8, 0.8), second),
               line(words(0.8, 0.8), words(1.6, 0.8), first)});
    for (const Words& corner : {words(0.8, 0), words(0.8, 0.8)}) {
      EXPECT_LE(distance(pieces, corner), 0.01 * 1.0001);
      EXPECT_GT(distance(pieces, corner), 0.0099) << "and is used";
    }
  }
}

// The same with arcs, whose span is searched again when the item between them is short.
TEST(CornerBlender, TheStricterToleranceHoldsWhereTheSpanIsSearchedAgain) {
  for (const bool strict_first : {true, false}) {
    PathItem arc;
    arc.piece = make_arc(words(10, 0), words(0, 10), Vec3(0, 0, 0), Vec3(0, 0, 1), kPi / 2);
    arc.tolerance_mm = strict_first ? 0.002 : 0.5;
    arc.tolerance_rad = 0.01;
    const double other = strict_first ? 0.5 : 0.002;
    const auto pieces =
        blend({arc, line(words(0, 10), words(0, 10.3), other), line(words(0, 10.3), words(3, 12), other)});
    EXPECT_LE(distance(pieces, words(0, 10)), 0.002 * 1.001);
  }
}

// Two blends on one item: together no longer than the item, each at least as long as the half of it allows.
TEST(CornerBlender, TwoBlendsShareTheItemBetweenThem) {
  const auto pieces = blend({line(words(0, 0), words(5, 0), 0.1), line(words(5, 0), words(5, 0.5), 0.1),
                             line(words(5, 0.5), words(10, 0.5), 0.1)});
  double blended = 0;
  for (const PlanPiece& p : pieces)
    if (p.piece.kind == PathPiece::Kind::kPolynomial) blended += p.piece.length;
  EXPECT_NEAR(blended, 4 * 0.25, 1e-9) << "two blends of 2 * 0.25";
  for (size_t i = 0; i + 1 < pieces.size(); ++i) {
    EXPECT_FALSE(pieces[i].ends_stretch);
    EXPECT_LT((pieces[i].piece.at(pieces[i].piece.length) - pieces[i + 1].piece.at(0)).norm(), 1e-12);
  }
  EXPECT_TRUE(pieces.back().ends_stretch);
}

TEST(CornerBlender, APathRunBackwardsHasTheSameBlends) {
  std::vector<Words> points{words(0, 0),     words(2, 0.4), words(2.3, 2),
                            words(2.4, 2.1), words(5, 1),   words(5, 4)};
  const auto run = [](const std::vector<Words>& at) {
    std::vector<PathItem> items;
    for (size_t i = 1; i < at.size(); ++i) items.push_back(line(at[i - 1], at[i], 0.03));
    return blend(items);
  };
  const auto there = run(points);
  std::reverse(points.begin(), points.end());
  const auto back = run(points);
  ASSERT_EQ(there.size(), back.size());
  for (size_t i = 0; i < there.size(); ++i) {
    const PathPiece &a = there[i].piece, &b = back[back.size() - 1 - i].piece;
    EXPECT_NEAR(a.length, b.length, 1e-9);
    EXPECT_LT((a.at(0.3 * a.length) - b.at(b.length - 0.3 * a.length)).norm(), 1e-9);
  }
}

// Each half of a blend belongs to its own item, with its line and outputs.
TEST(CornerBlender, OutputsActInTheMiddleOfTheBlend) {
  PathItem second = line(words(10, 0), words(10, 10), 0.05, 8);
  second.outputs.put(3, true);
  const auto pieces = blend({line(words(0, 0), words(10, 0), 0.05, 7), second});
  ASSERT_EQ(pieces.size(), 4u);
  const std::uint32_t lines[] = {7, 7, 8, 8};
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(pieces[i].source.line, lines[i]);
    EXPECT_EQ(pieces[i].outputs.any(), i == 2);
  }
}

}  // namespace
}  // namespace trn::geometry_check
