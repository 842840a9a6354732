#include <random>

#include "core/axes.h"
#include "core/frames.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/move.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/geometry_check.h"
#include "tests/support/rounds.h"

// G64 P where pieces meet in a tangent or nearly so: what a blend takes is judged at every place, by
// distance.
namespace trn {
namespace {

using namespace geometry_check;

double uniform(std::mt19937_64& rng, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(rng);
}

double log_uniform(std::mt19937_64& rng, double from, double to) {
  return std::exp(uniform(rng, std::log(from), std::log(to)));
}

// From `at` on in the direction `heading` (rad, in XY): a line, an arc or a helix; both are moved on.
ProgramMove next_move(std::mt19937_64& rng, Words& at, double& heading, double tolerance_mm) {
  const double size = log_uniform(rng, 0.05, 30),
               rise = uniform(rng, 0, 1) < 0.3 ? uniform(rng, -1, 1) * size : 0;
  const Words from = at;
  if (uniform(rng, 0, 1) < 0.3) {
    at.head<3>() += size * Vec3(std::cos(heading), std::sin(heading), rise / size);
    return line_move(from, at, tolerance_mm);
  }
  const double sweep = uniform(rng, 0.05, 4.5) * (uniform(rng, 0, 1) < 0.5 ? 1 : -1);
  const double side = sweep > 0 ? 1 : -1;
  const Vec3 centre = at.head<3>() + side * size * Vec3(-std::sin(heading), std::cos(heading), 0);
  heading += sweep;
  at.head<3>() = centre + side * size * Vec3(std::sin(heading), -std::cos(heading), 0) + Vec3(0, 0, rise);
  return arc_move(from, at, centre, sweep, tolerance_mm);
}

// Worst distance to the nearer of two moves, over the tolerance.
double worst_of(const std::vector<ProgramMove>& moves, const std::vector<PlanPiece>& pieces) {
  double worst = 0;
  for (const PlanPiece& p : pieces) {
    if (p.piece.kind != PathPiece::Kind::kPolynomial) continue;
    const auto usage = [&](double s) {
      const Words y = p.piece.at(s);
      return std::min(usage_of(moves[0], y), usage_of(moves[1], y));
    };
    const int places = 60;
    for (int k = 0; k <= places; ++k) worst = std::max(worst, usage(p.piece.length * k / places));
  }
  return worst;
}

TEST(BlendTolerance, IsKeptByTangentAndNearlyTangentMoves) {
  const int trials = test::rounds(300);
  int blends = 0;
  for (int trial = 0; trial < trials; ++trial) {
    std::mt19937_64 rng(static_cast<std::uint64_t>(trial));
    const double tolerance_mm = log_uniform(rng, 0.001, 1);
    Words at = words(uniform(rng, -50, 50), uniform(rng, -50, 50), 0);
    double heading = uniform(rng, -3, 3);
    std::vector<ProgramMove> moves{next_move(rng, at, heading, tolerance_mm)};
    if (uniform(rng, 0, 1) < 0.5) heading += log_uniform(rng, 1e-9, 0.3);
    moves.push_back(next_move(rng, at, heading, tolerance_mm));
    const auto pieces = plan(moves);
    blends += pieces.size() > 2;
    EXPECT_LE(worst_of(moves, pieces), 1.0) << "seed " << trial << ", P " << tolerance_mm;
  }
  EXPECT_GT(blends, trials / 2);
}

TEST(BlendTolerance, IsKeptByTwoTangentArcs) {
  const std::vector<ProgramMove> moves{arc_move(words(0, 0), words(4, 0), Vec3(2, 0, 0), kPi, 0.01),
                                       arc_move(words(4, 0), words(9, 0), Vec3(6.5, 0, 0), -kPi, 0.01)};
  const double used = worst_of(moves, plan(moves));
  EXPECT_LE(used, 1.0);
  EXPECT_GT(used, 0.99);
}

}  // namespace
}  // namespace trn
