// Moves per second through the geometry stage.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "core/axes.h"
#include "core/motion.h"
#include "interp/move.h"
#include "interp/plan/geometry/geometry_planner.h"
#include "interp/plan/stages.h"

namespace trn {
namespace {

struct Count : PieceSink {
  size_t pieces = 0;
  void piece(const PlanPiece&) override { ++pieces; }
  void event(const QueueEvent&, SourceLine) override {}
};

/// A surface pass with a tilting tool, chords of the given length, four decimals.
std::vector<ProgramMove> pass(double chord, double tolerance_mm) {
  const auto rounded = [](double x) { return std::round(x * 1e4) / 1e4; };
  std::vector<ProgramMove> moves(20000);
  Words at = Words::Zero();
  double t = 0;
  for (std::uint32_t i = 0; i < moves.size(); ++i) {
    t += chord / std::hypot(1.1, std::cos(0.5 * t));
    Words to = Words::Zero();
    to.head<3>() << rounded(t), rounded(0.1 * t), rounded(2 * std::sin(0.5 * t));
    to[kA] = rounded(20 * std::sin(0.05 * t)) / 57.29577951308232;
    ProgramMove& m = moves[i];
    m.kind = ProgramMove::Kind::kFeed;
    m.from = at;
    m.to = at = to;
    m.arc_centre.setZero();
    m.arc_axis.setZero();
    m.feed.tip_mm_s = 50;
    m.tolerance_mm = tolerance_mm;
    m.tolerance_rad = tolerance_mm / 10;
    m.source.line = i + 1;
  }
  return moves;
}

void run(benchmark::State& state, double chord, double tolerance_mm, bool compress) {
  const auto moves = pass(chord, tolerance_mm);
  Count count;
  for (auto _ : state) {
    GeometryPlanner planner({.compress = compress}, count);
    for (const auto& m : moves) planner.move(m);
    planner.finish();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * moves.size()));
  state.counters["pieces_per_move"] =
      static_cast<double>(count.pieces) / static_cast<double>(state.iterations() * moves.size());
}

BENCHMARK_CAPTURE(run, blends_0_5_mm, 0.5, 0.01, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, curve_0_05_mm, 0.05, 0.01, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, curve_0_2_mm, 0.2, 0.01, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, curve_0_5_mm, 0.5, 0.05, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, tube_1_mm, 1.0, 0.04, true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
