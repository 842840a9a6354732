#include "core/path.h"

#include <gtest/gtest.h>

#include <random>

namespace trn {
namespace {

Words random_words(std::mt19937_64& rng, double scale) {
  std::uniform_real_distribution<double> u(-scale, scale);
  Words y;
  for (int i = 0; i < 6; ++i) y[i] = u(rng);
  return y;
}

// The derivatives of a piece against central differences of its value.
void expect_consistent(const PathPiece& piece) {
  const double h = piece.length * 1e-3;
  for (double u : {0.1, 0.37, 0.5, 0.83}) {
    const double s = u * piece.length;
    const PathPoint p = piece.derivatives(s);
    EXPECT_LT((p.y - piece.at(s)).norm(), 1e-12 * (1 + p.y.norm()));
    const Words d1 = (piece.at(s + h) - piece.at(s - h)) / (2 * h);
    const Words d2 = (piece.at(s + h) - 2 * p.y + piece.at(s - h)) / (h * h);
    const PathPoint before = piece.derivatives(s - h), after = piece.derivatives(s + h);
    EXPECT_LT((p.d1 - d1).norm(), 1e-4 * (1 + p.d1.norm()));
    EXPECT_LT((p.d2 - d2).norm(), 1e-3 * (1 + p.d2.norm()));
    EXPECT_LT((p.d3 - (after.d2 - before.d2) / (2 * h)).norm(), 1e-3 * (1 + p.d3.norm()));
  }
}

TEST(Path, LineAdvancesOneUnitOfThePathNorm) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < 50; ++i) {
    const Words a = random_words(rng, 100), b = random_words(rng, 3);
    const PathPiece line = make_line(a, b);
    EXPECT_NEAR(path_norm(line.c[1]), 1.0, 1e-12);
    EXPECT_LT((line.at(line.length) - b).norm(), 1e-11);
    expect_consistent(line);
  }
}

TEST(Path, HelixHitsItsEndAndKeepsItsRadius) {
  Words from = Words::Zero(), to = Words::Zero();
  from.head<3>() << 30, 0, 5;
  to.head<3>() << 0, 30, 25;
  from[kC] = -1.25;
  to[kA] = 0.5;
  const PathPiece arc = make_arc(from, to, Vec3(0, 0, 5), Vec3(0, 0, 1), 2.5 * 3.14159265358979323846);
  EXPECT_LT((arc.at(arc.length) - to).norm(), 1e-11);
  for (int i = 0; i <= 20; ++i) EXPECT_NEAR(arc.at(arc.length * i / 20).head<2>().norm(), 30, 1e-11);
  EXPECT_NEAR(path_norm(arc.derivatives(3).d1), 1.0, 1e-12);
  expect_consistent(arc);
}

TEST(Path, HermiteMeetsValueAndThreeDerivativesAtBothEnds) {
  std::mt19937_64 rng(2);
  for (int i = 0; i < 50; ++i) {
    const double length = 0.01 + i;
    const PathPoint a{random_words(rng, 50), random_words(rng, 1), random_words(rng, 0.3),
                      random_words(rng, 0.1)};
    const PathPoint b{random_words(rng, 50), random_words(rng, 1), random_words(rng, 0.3),
                      random_words(rng, 0.1)};
    const PathPiece piece = make_hermite(a, b, length);
    for (const auto& [s, want] : {std::pair{0.0, a}, std::pair{length, b}}) {
      const PathPoint got = piece.derivatives(s);
      const double scale = 1 + want.y.norm() / length;
      EXPECT_LT((got.y - want.y).norm(), 1e-10);
      EXPECT_LT((got.d1 - want.d1).norm(), 1e-10 * scale);
      EXPECT_LT((got.d2 - want.d2).norm(), 1e-8 * scale / length);
      EXPECT_LT((got.d3 - want.d3).norm(), 1e-6 * scale / length / length);
    }
    expect_consistent(piece);
  }
}

TEST(Path, CutIsTheSameCurve) {
  Words from = Words::Zero(), to = Words::Zero();
  from.head<3>() << 10, 0, 0;
  to.head<3>() << 0, 10, 3;
  const PathPiece arc = make_arc(from, to, Vec3(0, 0, 0), Vec3(0, 0, 1), 1.5707963267948966);
  const PathPiece line = make_line(from, to);
  const PathPiece curve = make_hermite(arc.derivatives(0), arc.derivatives(arc.length), arc.length);
  for (const PathPiece& piece : {arc, line, curve}) {
    const double s0 = 0.2 * piece.length, s1 = 0.7 * piece.length;
    const PathPiece part = cut(piece, s0, s1);
    for (int i = 0; i <= 10; ++i) {
      const double s = part.length * i / 10;
      EXPECT_LT((part.at(s) - piece.at(s0 + s)).norm(), 1e-11);
      EXPECT_LT((part.derivatives(s).d3 - piece.derivatives(s0 + s).d3).norm(), 1e-8);
    }
  }
}

}  // namespace
}  // namespace trn
