#include "interp/plan/geometry/residual_moves.h"

#include "core/axes.h"
#include "core/frames.h"
#include "interp/move.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/driven_program.h"
#include "tests/support/rounds.h"

// Residual blocks: lines and half circles of a tenth of a micrometre and less that rounding leaves between
// the moves of a program. They cost nothing in continuous mode and keep the tolerances, lines and outputs; in
// exact mode they cost their own stops. TRN_LONG=10000: so many corners.
namespace trn::speed_test {
namespace {

using geometry_check::words;

/// Long moves from corner to corner; lines numbered in program order.
struct Program {
  std::mt19937_64 rng;
  double tolerance_mm = 0.01;
  PathMode mode = PathMode::kContinuous;

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng); }

  Words direction(double mm, double rad) {
    std::normal_distribution<double> g;
    Words w = Words::Zero();
    const Vec3 p = Vec3(g(rng), g(rng), g(rng)).normalized() * mm;
    w.head<3>() = p;
    if (rad > 0) {
      const double angle = uniform(0, 2 * kPi);
      w[kA] = rad * std::cos(angle);
      w[kC] = rad * std::sin(angle);
    }
    return w;
  }

  std::vector<Words> corners() {
    std::vector<Words> out{Words::Zero()};
    const bool turning = rng() % 3 == 0;
    for (size_t i = 0, n = 2 + rng() % 2; i < n; ++i)
      out.push_back(out.back() + direction(uniform(5, 50), turning ? uniform(0.02, 0.3) : 0));
    return out;
  }

  /// Ways of one to ten residual blocks: all linear, all rotary, or both.
  std::vector<Words> residuals() {
    const double sizes[] = {1e-4, 1e-4, 1e-6, 1e-5};
    const double size = sizes[rng() % 4];
    const int kind = static_cast<int>(rng() % 4);
    std::vector<Words> out;
    for (size_t i = 0, n = 1 + rng() % 10; i < n; ++i) {
      const double mm = kind == 2 ? 0 : size, rad = kind < 2 ? 0 : size * kRadPerDeg;
      out.push_back(direction(mm, rad));
    }
    return out;
  }

  void append(const Words& to, std::vector<ProgramMove>& moves, const Words& start) {
    ProgramMove m = geometry_check::line_move(moves.empty() ? start : moves.back().to, to, tolerance_mm,
                                              0.05 * kRadPerDeg);
    m.feed.tip_mm_s = 100;
    m.feed.rotary_rad_s = 1;
    m.mode = mode;
    m.source.line = static_cast<std::uint32_t>(moves.size() + 1);
    moves.push_back(m);
  }

  /// The last move as a half circle instead of a line: arcs of a tenth of a micrometre stand in programs too.
  void bend(ProgramMove& m) {
    const Vec3 way = (m.to - m.from).head<3>();
    if (way.isZero(0)) return;
    m.kind = ProgramMove::Kind::kArc;
    m.arc_centre = (m.from + m.to).head<3>() / 2;
    m.arc_axis = way.unitOrthogonal();
    m.arc_sweep_rad = rng() % 2 ? kPi : -kPi;
  }

  std::vector<ProgramMove> moves(const std::vector<Words>& corners, bool with_residuals, bool arcs = false) {
    std::vector<ProgramMove> out;
    for (size_t i = 1; i < corners.size(); ++i) {
      append(corners[i], out, corners[0]);
      if (!with_residuals || i + 1 == corners.size()) continue;
      Words at = corners[i];
      for (const Words& way : residuals()) {
        append(at += arcs ? Words(way * 2 / kPi) : way, out, corners[0]);  // as long, bent or not
        if (arcs) bend(out.back());
      }
    }
    return out;
  }
};

TEST(ResidualMoves, CostNoTimeAtCorners) {
  double worst = 0;
  for (int seed = 1; seed <= test::rounds(150); ++seed) {
    Program program{std::mt19937_64(static_cast<unsigned>(seed))};
    program.tolerance_mm = seed % 3 == 0 ? 0.05 : 0.01;
    const std::vector<Words> corners = program.corners();
    const std::vector<ProgramMove> with = program.moves(corners, true, seed % 4 == 0);
    const DrivenProgram plain = drive_program(program.moves(corners, false)), driven = drive_program(with);
    worst = std::max(worst, driven.stats.time_s / plain.stats.time_s);
    ASSERT_LT(driven.stats.time_s, 1.01 * plain.stats.time_s) << "seed " << seed;
    ASSERT_EQ(driven.stats.fallbacks, 0U) << "seed " << seed;
    ASSERT_LE(geometry_check::worst_usage(with, driven.pieces, 16, 12), 1) << "seed " << seed;
    ASSERT_LT((driven.pieces.back().piece.at(driven.pieces.back().piece.length) - with.back().to).norm(),
              1e-9);
  }
  std::printf("worst: %.4f of the time without them\n", worst);
}

// Two stops at each end of a tiny move, and no more.
TEST(ResidualMoves, CostTheirStopsInExactMode) {
  for (int seed = 1; seed <= test::rounds(40); ++seed) {
    Program program{std::mt19937_64(static_cast<unsigned>(seed))};
    program.mode = PathMode::kExactPath;
    const std::vector<Words> corners = program.corners();
    const std::vector<ProgramMove> with = program.moves(corners, true);
    const double plain_s = drive_program(program.moves(corners, false)).stats.time_s;
    const DrivenProgram driven = drive_program(with);
    const double stops_s = 5e-3 * static_cast<double>(with.size() - (corners.size() - 1));
    ASSERT_LT(driven.stats.time_s, plain_s + stops_s) << "seed " << seed;
    ASSERT_EQ(driven.stats.fallbacks, 0U) << "seed " << seed;
  }
}

// Four decimals, and here and there a move that they cut to pieces, on corners, arcs and runs of tiny chords.
TEST(ResidualMoves, CostNoTimeInProgramsOfFourDecimals) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 rng(seed);
    std::vector<Words> points{Words::Zero()}, rounded = points;
    std::vector<ProgramMove> plain, with;
    const auto append = [&](const Words& to, std::vector<ProgramMove>& moves) {
      ProgramMove m =
          geometry_check::line_move(moves.empty() ? Words::Zero() : moves.back().to, to, 0.01, 0.001);
      m.feed.tip_mm_s = 100;
      m.source.line = static_cast<std::uint32_t>(moves.size() + 1);
      moves.push_back(m);
    };
    for (int i = 1; i <= 600; ++i) {
      const double t = i / (seed % 2 ? 60.0 : 15.0);
      Words at = words(20 * std::cos(t) - 20, 20 * std::sin(t), 3 * std::sin(1.7 * t), 0, 0, 0);
      if (i % 100 == 0) at[kZ] += 5;
      for (int k = 0; k < 3; ++k) at[k] = std::round(at[k] * 1e4) / 1e4;
      append(at, plain);
      append(at, with);
      for (size_t k = rng() % 7 == 0 ? 1 + rng() % 3 : 0; k > 0; --k) {
        at[static_cast<int>(rng() % 3)] += rng() % 2 ? 1e-4 : -1e-4;
        append(at, with);
      }
    }
    const DrivenProgram a = drive_program(plain), b = drive_program(with, true);
    std::printf("seed %u: %.3f s, with residuals %.3f s\n", seed, a.stats.time_s, b.stats.time_s);
    EXPECT_LT(b.stats.time_s, 1.02 * a.stats.time_s) << "seed " << seed;
    EXPECT_EQ(b.stats.fallbacks, 0U) << "seed " << seed;
    EXPECT_LE(geometry_check::worst_usage_of_runs(with, b.pieces), 1) << "seed " << seed;
    EXPECT_LE(b.verdict.jerk, 1) << "seed " << seed;
  }
}

TEST(ResidualMoves, KeepOutputsAndSlowBlocks) {
  Program program{std::mt19937_64(1)};
  std::vector<ProgramMove> moves;
  const Words start = Words::Zero();
  program.append(words(20, 0), moves, start);
  program.append(words(20, 1e-4), moves, start);
  program.append(words(20, 20), moves, start);
  moves[1].outputs.put(3, true);
  std::vector<PlanPiece> pieces = geometry_check::plan(moves);
  size_t with_outputs = 0;
  for (const PlanPiece& piece : pieces) {
    if (!piece.outputs.any()) continue;
    ++with_outputs;
    EXPECT_LT((piece.piece.at(0) - words(20, 0)).norm(), 0.011);
  }
  EXPECT_EQ(with_outputs, 1U);

  moves[1].outputs = {};
  moves[1].duration_s = 0.1;  // inverse time
  const double slow_s = drive_program(moves).stats.time_s;
  moves[1].duration_s = 0;
  EXPECT_NEAR(slow_s - drive_program(moves).stats.time_s, 0.1, 0.02);
}

}  // namespace
}  // namespace trn::speed_test
