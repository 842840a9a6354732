#include "interp/plan/geometry/compressor.h"

#include <functional>
#include <random>

#include "core/axes.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/geometry_check.h"
#include "tests/support/rounds.h"

namespace trn {
namespace {

using namespace geometry_check;
using Curve = std::function<Words(double)>;

constexpr double kPi = 3.14159265358979323846;

double rounded(double x) { return std::round(x * 1e4) / 1e4; }

/// As a post-processor writes it: four decimals, mm and degrees.
Words rounded(Words y) {
  for (int i = 0; i < 3; ++i) y[i] = rounded(y[i]);
  for (int i = 3; i < 6; ++i) y[i] = rounded(y[i] * 180 / kPi) * kPi / 180;
  return y;
}

/// Points of the curve on t in [0, t_end], `chord` apart in the path norm.
std::vector<Words> sampled(const Curve& curve, double t_end, double chord) {
  std::vector<Words> points{rounded(curve(0))};
  for (double t = 0; t < t_end;) {
    double dt = t_end * 1e-3;
    for (int i = 0; i < 30; ++i) dt *= chord / std::max(path_norm(curve(t + dt) - curve(t)), 1e-12);
    t = t + 1.3 * dt > t_end ? t_end : t + dt;
    points.push_back(rounded(curve(t)));
  }
  return points;
}

Words sine(double t) { return words(t, 3.3 + 0.1 * t, 2 * std::sin(0.5 * t) + 0.5 * std::sin(1.1 * t + 1)); }
Words helix(double t) { return words(10 * std::cos(t), 10 * std::sin(t), 0.8 * t); }
Words impeller(double t) {
  const double w = 3 * kPi * t / 100, v = 0.5 - 0.5 * std::cos(w), r = 18 + 24 * v;
  const double az = (25 + 70 * std::pow(v, 1.5) + 0.18 * t) * kPi / 180;
  return words(r * std::cos(az), r * std::sin(az), 26 * (1 - v) * (1 - v) + 0.03 * t,
               -0.5 - 0.4 * std::sin(0.8 * w), 0, 1.2 * az);
}

struct Shape {
  double pieces = 0, length = 0, max_d3 = 0;
};

/// Words whose plain norm is the path norm.
Words scaled(const Words& y) {
  Words out = y;
  out.tail<3>() *= kMmPerRadInPath;
  return out;
}

/// |y'''| by arc length in the path norm, whatever the parameter.
double d3_by_length(const PathPoint& p) {
  const Words d1 = scaled(p.d1), d2 = scaled(p.d2), d3 = scaled(p.d3);
  const double v = d1.norm(), v1 = d1.dot(d2) / v, v2 = (d2.squaredNorm() + d1.dot(d3) - v1 * v1) / v;
  const Words by1 = d1 / v, by2 = (d2 - v1 * by1) / (v * v);
  return ((d3 - 3 * v * v1 * by2 - v2 * by1) / (v * v * v)).norm();
}

/// Largest |y'''| by arc length away from the ends.
Shape shape_of(const std::vector<PlanPiece>& pieces) {
  Shape shape;
  for (const auto& p : pieces) shape.length += p.piece.length;
  double s = 0;
  for (const auto& p : pieces) {
    for (int k = 0; k <= 16; ++k) {
      const double at = s + p.piece.length * k / 16;
      if (at < 0.04 * shape.length || at > 0.96 * shape.length) continue;
      shape.max_d3 = std::max(shape.max_d3, d3_by_length(p.piece.derivatives(p.piece.length * k / 16)));
    }
    s += p.piece.length;
  }
  shape.pieces = static_cast<double>(pieces.size());
  return shape;
}

/// Third derivative by arc length of the curve itself, by finite differences on a dense arc-length table.
double true_max_d3(const Curve& curve, double t_end) {
  constexpr int kTable = 40000;
  std::vector<double> s(1, 0);
  for (int i = 1; i <= kTable; ++i)
    s.push_back(s.back() + path_norm(curve(t_end * i / kTable) - curve(t_end * (i - 1) / kTable)));
  const auto at = [&](double u) {
    const auto i = std::clamp<std::ptrdiff_t>(std::upper_bound(s.begin(), s.end(), u) - s.begin(), 1, kTable);
    const auto k = static_cast<size_t>(i);
    return curve(t_end * (static_cast<double>(i - 1) + (u - s[k - 1]) / (s[k] - s[k - 1])) / kTable);
  };
  const double h = s.back() / 600;
  double worst = 0;
  for (double u = 3 * h; u < s.back() - 3 * h; u += h)
    worst = std::max(
        worst, path_norm(at(u + 2 * h) - 2 * at(u + h) + 2 * at(u - h) - at(u - 2 * h)) / (2 * h * h * h));
  return worst;
}

void expect_sound(const std::vector<ProgramMove>& moves, const std::vector<PlanPiece>& pieces) {
  expect_continuous(pieces);
  EXPECT_LE(worst_usage_of_runs(moves, pieces), 1.0 + 1e-9);
  EXPECT_LT((pieces.front().piece.at(0) - moves.front().from).norm(), 1e-11);
  EXPECT_LT((pieces.back().piece.at(pieces.back().piece.length) - moves.back().to).norm(), 1e-11);
  EXPECT_TRUE(pieces.back().ends_stretch);
  for (size_t i = 1; i < pieces.size(); ++i) EXPECT_GE(pieces[i].source.line, pieces[i - 1].source.line);
}

TEST(Compressor, SampledCurvesComeOutAsTheCurve) {
  const std::pair<Curve, double> curves[] = {{sine, 60}, {helix, 12}, {impeller, 60}};
  for (const auto& [curve, t_end] : curves) {
    const double truth = true_max_d3(curve, t_end);
    for (double chord : {0.05, 0.2, 0.5}) {
      const double tolerance = chord > 0.3 ? 0.04 : 0.01;  // above the chord's own error
      const auto moves = polyline(sampled(curve, t_end, chord), tolerance, tolerance / 10);
      const auto pieces = plan(moves);
      expect_sound(moves, pieces);
      EXPECT_EQ(stretches(pieces), 1u);
      const Shape shape = shape_of(pieces);
      EXPECT_LT(shape.max_d3, 1.8 * truth) << "chord " << chord;
      EXPECT_LT(shape.pieces, shape.length / 0.3) << "chord " << chord;
    }
  }
}

/// Distance of the end of one path's points to the other path, densest sampling first.
double distance(const std::vector<PlanPiece>& a, const std::vector<PlanPiece>& b) {
  std::vector<Words> points;
  for (const auto& p : b)
    for (int k = 0; k < 400; ++k) points.push_back(p.piece.at(p.piece.length * k / 400));
  double worst = 0;
  for (const auto& p : a) {
    double best = 1e300;
    for (const Words& y : points) best = std::min(best, path_norm(p.piece.at(p.piece.length / 3) - y));
    worst = std::max(worst, best);
  }
  return worst;
}

TEST(Compressor, FineAndCoarseAndReversedSamplesGiveNearlyTheSameCurve) {
  const auto fine = plan(polyline(sampled(sine, 40, 0.05), 0.05));
  const auto coarse = plan(polyline(sampled(sine, 40, 0.5), 0.05));
  EXPECT_LT(distance(fine, coarse), 0.03);  // the coarse chords' own error is 0.035
  EXPECT_NEAR(shape_of(coarse).max_d3 / shape_of(fine).max_d3, 1.0, 0.6);

  auto points = sampled(sine, 40, 0.2);
  const auto forward = plan(polyline(points, 0.02));
  std::reverse(points.begin(), points.end());
  const auto back = plan(polyline(points, 0.02));
  EXPECT_LT(distance(forward, back), 0.012);  // half of it is the spacing of the compared points
}

TEST(Compressor, CornersAreKeptAndBlended) {
  std::vector<Words> points;
  for (int i = 0; i <= 200; ++i) points.push_back(rounded(words(0.1 * i, std::sin(0.2 * i))));
  const Words corner = points.back();
  for (int i = 1; i <= 200; ++i) points.push_back(rounded(corner + words(-std::sin(0.05 * i), 0.1 * i)));
  const auto moves = polyline(points, 0.02);
  const auto pieces = plan(moves);
  expect_sound(moves, pieces);
  EXPECT_EQ(stretches(pieces), 1u);
  double miss = 1e300;
  for (const auto& p : pieces)
    for (int k = 0; k <= 50; ++k)
      miss = std::min(miss, (p.piece.at(p.piece.length * k / 50) - corner).norm());
  EXPECT_LE(miss, 0.02);
  EXPECT_GE(miss, 0.005);  // a good part of the tolerance is used
}

TEST(Compressor, LongLinesStayLinesAndJoinCurvesSmoothly) {
  std::vector<Words> points{words(-60, 20)};
  for (int i = 0; i <= 300; ++i)
    points.push_back(rounded(words(20 * std::sin(kPi * i / 300), 20 * std::cos(kPi * i / 300))));
  points.push_back(words(-60, -20));
  const auto moves = polyline(points, 0.02);
  const auto pieces = plan(moves);
  expect_sound(moves, pieces);
  EXPECT_EQ(stretches(pieces), 1u);
  EXPECT_EQ(pieces.front().piece.kind, PathPiece::Kind::kLine);
  EXPECT_GT(pieces.front().piece.length, 50);
  EXPECT_EQ(pieces.back().piece.kind, PathPiece::Kind::kLine);
  EXPECT_LT(pieces.size(), 120u);
  EXPECT_LT(shape_of(pieces).max_d3, 0.2);  // curvature 1/20 within some mm
}

// A degree counts less along the curve than along the lines that it joins: there their parameters meet.
TEST(Compressor, LongLinesThatTurnTheToolJoinCurvesSmoothly) {
  for (const double turn_deg : {5.0, 40.0, 400.0}) {  // in a line of 30 mm
    SCOPED_TRACE(turn_deg);
    const double per_mm = turn_deg / 30 * kRadPerDeg;
    std::vector<Words> points{words(-30, 20, 0, 0, 0, -30 * per_mm)};
    for (int i = 0; i <= 60; ++i) {
      const double angle = kPi * i / 60;
      points.push_back(words(20 * std::sin(angle), 20 * std::cos(angle), 0, 0, 0, 20 * angle * per_mm));
    }
    points.push_back(words(-30, -20, 0, 0, 0, (20 * kPi + 30) * per_mm));
    const auto moves = polyline(points, 0.05, 0.005);
    const auto pieces = plan(moves);
    expect_sound(moves, pieces);
    EXPECT_EQ(stretches(pieces), 1u);
    EXPECT_EQ(pieces.front().piece.kind, PathPiece::Kind::kLine);
    EXPECT_EQ(pieces.back().piece.kind, PathPiece::Kind::kLine);
    EXPECT_LT(pieces.size(), 150u);
  }
}

TEST(Compressor, FeedsStayWithTheirMoves) {
  auto moves = polyline(sampled(helix, 6, 0.3), 0.02);
  for (auto& m : moves) m.feed.tip_mm_s = m.source.line <= 100 ? 20 : 40;
  const auto pieces = plan(moves);
  expect_sound(moves, pieces);
  double slow = 0;
  for (const auto& p : pieces) {
    EXPECT_EQ(p.feed.tip_mm_s, p.source.line <= 100 ? 20 : 40);
    if (p.source.line <= 100) slow += p.piece.length;
  }
  EXPECT_NEAR(slow, 30, 0.5);
}

TEST(Compressor, RandomWalksAreSoundWhateverComesOut) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<double> u(-1, 1);
  const int trials = test::rounds(12);
  for (int trial = 0; trial < trials; ++trial) {
    const double step = std::pow(10, -1.5 + 1.5 * u(rng)), wild = std::pow(10, -0.7 + u(rng));
    const bool five = trial % 2;
    std::vector<Words> points{words(20, 30, 10)};
    Words direction = words(1, 0, 0, five ? 0.005 : 0, 0, 0), turn = Words::Zero();
    for (int i = 0; i < 400; ++i) {
      for (int k = 0; k < (five ? 6 : 3); ++k)
        turn[k] = 0.8 * turn[k] + wild * u(rng) / (k < 3 ? 1 : kMmPerRadInPath);
      if (i % 50 == 49) turn *= 10;  // a corner
      direction += turn;
      direction /= path_norm(direction);
      points.push_back(points.back() + direction * step * std::exp(u(rng) * (i % 3)));
    }
    const auto moves = polyline(points, std::pow(10, -2 + u(rng)), std::pow(10, -3.5 + u(rng)));
    expect_sound(moves, plan(moves));
    if (HasFailure()) FAIL() << "trial " << trial;
  }
}

TEST(Compressor, TiniestMovesVanishInTheCurve) {
  std::vector<Words> points{words(5, 5)};
  for (int i = 1; i <= 1000; ++i) points.push_back(words(5 + 1e-6 * i, 5 + 1e-7 * i));
  for (int i = 1; i <= 200; ++i) points.push_back(words(5.001 + 0.1 * i, 5.0001 + 0.01 * i));
  const auto moves = polyline(points, 0.01);
  const auto pieces = plan(moves);
  expect_sound(moves, pieces);
  EXPECT_EQ(stretches(pieces), 1u);
  EXPECT_LT(pieces.size(), 400u);
}

/// Counts how far the output lags behind: bounded, whatever the length of the run.
TEST(Compressor, LooksABoundedNumberOfMovesAhead) {
  Collector out;
  GeometryPlanner planner({}, out);
  std::uint32_t lag = 0;
  for (std::uint32_t i = 0; i < 50000; ++i) {
    ProgramMove move = line_move(sine(0.02 * i), sine(0.02 * (i + 1)), 0.01);
    move.source.line = i + 1;
    planner.move(move);
    if (!out.pieces.empty()) lag = std::max(lag, i - out.pieces.back().source.line);
  }
  planner.finish();
  expect_continuous(out.pieces);
  EXPECT_EQ(stretches(out.pieces), 1u);
  EXPECT_LT(lag, 5000u);
  EXPECT_LT(out.pieces.size(), 4000u);
}

}  // namespace
}  // namespace trn
