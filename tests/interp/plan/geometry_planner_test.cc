#include "interp/plan/geometry/geometry_planner.h"

#include <random>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/geometry_check.h"

namespace trn {
namespace {

using namespace geometry_check;

constexpr double kPi = 3.14159265358979323846;
const GeometryOptions kBlendOnly{.compress = false};

std::vector<Words> random_points(std::mt19937_64& rng, int n, double step, bool five) {
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Words> points{words(u(rng) * 50, u(rng) * 50, u(rng) * 50)};
  for (int i = 0; i < n; ++i) {
    Words d = Words::Zero();
    const double scale = step * std::exp(1.5 * u(rng));
    for (int k = 0; k < 3; ++k) d[k] = u(rng) * scale;
    if (five) d[kA] = u(rng) * scale / 30, d[kC] = u(rng) * scale / 30;
    points.push_back(points.back() + d);
  }
  return points;
}

TEST(GeometryPlanner, RandomPolylinesAreSmoothInsideToleranceAndComplete) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> u(0, 1);
  for (int trial = 0; trial < 60; ++trial) {
    const auto points = random_points(rng, 40, std::pow(10, 2 * u(rng) - 1), trial % 2);
    const auto moves = polyline(points, std::pow(10, -3 + 3 * u(rng)), std::pow(10, -4 + 2 * u(rng)));
    const auto pieces = plan(moves, kBlendOnly);
    expect_continuous(pieces);
    EXPECT_LE(worst_usage(moves, pieces), 1.0 + 1e-9);
    EXPECT_LT((pieces.front().piece.at(0) - points.front()).norm(), 1e-12);
    EXPECT_LT((pieces.back().piece.at(pieces.back().piece.length) - points.back()).norm(), 1e-12);
    EXPECT_TRUE(pieces.back().ends_stretch);
    for (size_t i = 1; i < pieces.size(); ++i) EXPECT_GE(pieces[i].source.line, pieces[i - 1].source.line);
    for (size_t line = 1, i = 0; line <= moves.size(); ++line) {  // every line has a piece
      while (i < pieces.size() && pieces[i].source.line < line) ++i;
      ASSERT_LT(i, pieces.size());
      EXPECT_EQ(pieces[i].source.line, line);
    }
  }
}

TEST(GeometryPlanner, RandomLinesAndArcsAreSmoothAndInsideTolerance) {
  std::mt19937_64 rng(2);
  std::uniform_real_distribution<double> u(-1, 1);
  for (int trial = 0; trial < 12; ++trial) {
    std::vector<ProgramMove> moves;
    Words at = words(10, 20, 30);
    const double tol = std::pow(10, -2 + 1.5 * u(rng));
    for (int i = 0; i < 20; ++i) {
      Words to = at + words(10 * u(rng), 10 * u(rng), 5 * u(rng), 0.02 * u(rng), 0, 0.02 * u(rng));
      if (i % 2) {
        const Vec3 centre = at.head<3>() + Vec3(6 * u(rng), 6 * u(rng), 0);
        const double sweep = 7 * u(rng);
        const Vec3 r = at.head<3>() - centre;
        to[kX] = centre.x() + r.x() * std::cos(sweep) - r.y() * std::sin(sweep);
        to[kY] = centre.y() + r.x() * std::sin(sweep) + r.y() * std::cos(sweep);
        moves.push_back(arc_move(at, to, centre, sweep, tol));
      } else {
        moves.push_back(line_move(at, to, tol));
      }
      moves.back().source.line = static_cast<std::uint32_t>(i + 1);
      at = to;
    }
    const auto pieces = plan(moves, kBlendOnly);
    expect_continuous(pieces);
    EXPECT_LE(worst_usage(moves, pieces), 1.0 + 1e-6) << trial;
  }
}

double miss(const std::vector<PlanPiece>& pieces, const Words& vertex) {
  double best = 1e300;
  for (const auto& p : pieces)
    for (int k = 0; k <= 200; ++k)
      best = std::min(best, (p.piece.at(p.piece.length * k / 200) - vertex).head<3>().norm());
  return best;
}

TEST(GeometryPlanner, LongSegmentsUseTheWholeTolerance) {
  for (double angle : {0.05, 0.5, 1.2, kPi / 2, 2.5, 3.0})
    for (double tol : {0.002, 0.05, 0.4}) {
      const Words corner = words(100, 0);
      const auto moves =
          polyline({words(0, 0), corner, corner + 100 * words(std::cos(angle), std::sin(angle))}, tol);
      EXPECT_NEAR(miss(plan(moves, kBlendOnly), corner) / tol, 1.0, 0.01) << angle;
    }
}

TEST(GeometryPlanner, LineIntoArcUsesTheWholeTolerance) {
  const Words corner = words(40, 0);
  for (double tol : {0.002, 0.05}) {
    std::vector<ProgramMove> moves = {line_move(words(0, 0), corner, tol),
                                      arc_move(corner, words(80, 0), Vec3(60, 0, 0), kPi, tol)};
    EXPECT_NEAR(miss(plan(moves, kBlendOnly), corner) / tol, 1.0, 0.01);
  }
}

TEST(GeometryPlanner, OrientationToleranceBinds) {
  const double tol = 0.002;
  const Words corner = words(50, 0, 0, 0.3);
  const auto moves = polyline({words(0, 0), corner, words(100, 0, 0, 0)}, 1.0, tol);
  const auto pieces = plan(moves, kBlendOnly);
  ASSERT_EQ(pieces.size(), 4u);
  const PathPiece& blend = pieces[1].piece;
  EXPECT_NEAR((blend.at(blend.length) - corner).tail<3>().norm() / tol, 1.0, 0.01);
}

TEST(GeometryPlanner, ShortItemsAreSharedAndBlendsAreTheSameBackwards) {
  std::vector<Words> points = {words(0, 0), words(5, 0),   words(5, 0.7),
                               words(9, 1), words(9, 1.5), words(20, 8)};
  const auto forward = plan(polyline(points, 0.3), kBlendOnly);
  std::reverse(points.begin(), points.end());
  const auto back = plan(polyline(points, 0.3), kBlendOnly);
  ASSERT_EQ(forward.size(), back.size());
  for (size_t i = 0; i < forward.size(); ++i) {
    const PathPiece &f = forward[i].piece, &b = back[back.size() - 1 - i].piece;
    EXPECT_NEAR(f.length, b.length, 1e-9);
    for (double u : {0.0, 0.3, 0.8}) EXPECT_LT((f.at(u * f.length) - b.at((1 - u) * b.length)).norm(), 1e-9);
  }
}

TEST(GeometryPlanner, HalvesOfABlendCarryTheirOwnMove) {
  auto moves = polyline({words(0, 0), words(10, 0), words(10, 10)});
  moves[0].kind = ProgramMove::Kind::kTraverse;
  moves[1].feed.tip_mm_s = 7;
  moves[1].duration_s = 10.0 / 3;
  const auto pieces = plan(moves, kBlendOnly);
  ASSERT_EQ(pieces.size(), 4u);
  EXPECT_TRUE(pieces[1].rapid);
  EXPECT_FALSE(pieces[2].rapid);
  EXPECT_EQ(pieces[1].source.line, 1u);
  EXPECT_EQ(pieces[2].source.line, 2u);
  EXPECT_EQ(pieces[1].feed.tip_mm_s, 50);
  EXPECT_EQ(pieces[2].feed.tip_mm_s, 7);
  EXPECT_NEAR(pieces[2].feed.path_units_s, 3, 1e-12);
  EXPECT_NEAR(pieces[1].piece.length, pieces[2].piece.length, 1e-12);
}

TEST(GeometryPlanner, ExactStopIsExactAndStopsEverywhere) {
  auto moves = polyline({words(0, 0), words(5, 0), words(10, 0), words(10, 7)});
  for (auto& m : moves) m.mode = PathMode::kExactStop;
  const auto pieces = plan(moves);
  ASSERT_EQ(pieces.size(), 3u);
  EXPECT_EQ(stretches(pieces), 3u);
  for (size_t i = 0; i < 3; ++i)
    EXPECT_LT((pieces[i].piece.at(pieces[i].piece.length) - moves[i].to).norm(), 1e-12);
}

TEST(GeometryPlanner, ExactPathStopsOnlyWhereThePathIsNotSmooth) {
  std::vector<ProgramMove> moves = polyline({words(0, 0), words(1.1, 2.2), words(3.3, 6.6), words(20, 6.6)});
  moves.push_back(arc_move(words(20, 6.6), words(20, 26.6), Vec3(20, 16.6, 0), kPi));  // tangent: stop
  moves.push_back(arc_move(words(20, 26.6), words(20, 6.6), Vec3(20, 16.6, 0), kPi));  // same circle: none
  for (auto& m : moves) m.mode = PathMode::kExactPath;
  const auto pieces = plan(moves);
  expect_continuous(pieces);
  ASSERT_EQ(pieces.size(), 5u);
  const bool stops[] = {false, true, true, false, true};
  for (size_t i = 0; i < 5; ++i) EXPECT_EQ(pieces[i].ends_stretch, stops[i]) << i;
}

TEST(GeometryPlanner, StopsAtEventContextModeReversalAndZeroTolerance) {
  const std::vector<Words> points = {words(0, 0), words(10, 0), words(10, 10)};
  const auto count = [&](auto change) {
    auto moves = polyline(points);
    change(moves[1]);
    return stretches(plan(moves, kBlendOnly));
  };
  EXPECT_EQ(count([](ProgramMove&) {}), 1u);
  EXPECT_EQ(count([](ProgramMove& m) { m.context.rtcp = true; }), 2u);
  EXPECT_EQ(count([](ProgramMove& m) { m.context.tool_offset.z() = 5; }), 2u);
  EXPECT_EQ(count([](ProgramMove& m) { m.context.X_WB.p.x() = 1; }), 2u);
  EXPECT_EQ(count([](ProgramMove& m) { m.mode = PathMode::kExactPath; }), 2u);
  EXPECT_EQ(count([](ProgramMove& m) { m.tolerance_mm = 0; }), 2u);
  EXPECT_EQ(count([](ProgramMove& m) { m.to = words(1, 0.01); }), 2u);

  Collector out;
  GeometryPlanner planner(kBlendOnly, out);
  const auto moves = polyline({words(0, 0), words(10, 0), words(20, 0)});
  planner.event({QueueEvent::Kind::kSpindle, 1000, 0}, {1});
  planner.move(moves[0]);
  planner.event({QueueEvent::Kind::kDwell, 0.5, 0}, {7});
  planner.move(moves[1]);
  planner.finish();
  ASSERT_EQ(out.pieces.size(), 2u);
  EXPECT_TRUE(out.pieces[0].ends_stretch);
  ASSERT_EQ(out.events.size(), 2u);
  EXPECT_EQ(out.events[0].after, 0u);
  EXPECT_EQ(out.events[1].after, 1u);
  EXPECT_EQ(out.events[1].line, 7u);
}

TEST(GeometryPlanner, DegenerateInput) {
  EXPECT_TRUE(plan({}).empty());
  EXPECT_TRUE(plan(polyline({words(1, 2), words(1, 2), words(1, 2)})).empty());

  auto pieces = plan(polyline({words(0, 0), words(0, 0), words(3, 0), words(3, 0), words(6, 0)}), kBlendOnly);
  ASSERT_EQ(pieces.size(), 2u);  // collinear: joined without a blend
  EXPECT_EQ(pieces[0].source.line, 2u);
  EXPECT_EQ(pieces[1].source.line, 4u);
  EXPECT_FALSE(pieces[0].ends_stretch);

  std::vector<ProgramMove> circles = {arc_move(words(20, 0), words(20, 0), Vec3(0, 0, 0), 2 * kPi),
                                      arc_move(words(20, 0), words(20, 0, 30), Vec3(0, 0, 0), 10 * kPi)};
  circles[1].source.line = 1;
  pieces = plan(circles);
  expect_continuous(pieces);
  EXPECT_EQ(stretches(pieces), 1u);

  auto gap = polyline({words(0, 0), words(3, 0), words(6, 0)});
  gap[1].from[kX] = 4;
  EXPECT_THROW(plan(gap), ProgramError);
  gap[1].from[kX] = std::nan("");
  EXPECT_THROW(plan(gap), ProgramError);
}

TEST(GeometryPlanner, AnArcWithUnequalRadiiEndsWhereItSays) {
  std::vector<ProgramMove> moves = {line_move(words(0, 0), words(20, 0)),
                                    arc_move(words(20, 0), words(20.0005, 20.0003), Vec3(20, 10, 0), kPi),
                                    line_move(words(20.0005, 20.0003), words(0, 20))};
  for (auto& m : moves) m.mode = PathMode::kExactPath;
  const auto pieces = plan(moves);
  ASSERT_EQ(pieces.size(), 3u);
  expect_continuous(pieces);
}

}  // namespace
}  // namespace trn
