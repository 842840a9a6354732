#include <benchmark/benchmark.h>

#include "bench/processor_time.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_planner.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"

// The speed stage alone: short blended five-axis pieces through a trunnion, and a three-axis run.
namespace trn::speed_test {
namespace {

struct Count : BlockSink {
  std::size_t blocks = 0;
  void block(const MotionBlock&) override { ++blocks; }
};

void plan_all(benchmark::State& state, const std::vector<PathPiece>& pieces, const Joints& joints,
              const JointMap& map) {
  SpeedStats stats;
  double loop_s = calibration_s();
  for (auto _ : state) {
    Count out;
    SpeedPlanner planner(joints, map, {}, out);
    for (const PathPiece& piece : pieces) planner.piece(plan(piece, 100));
    planner.finish();
    stats = planner.stats();
  }
  const double runs = static_cast<double>(state.iterations()), count = static_cast<double>(pieces.size());
  state.counters["pieces/s"] = benchmark::Counter(runs * count, benchmark::Counter::kIsRate);
  loop_s = std::min(loop_s, calibration_s());
  state.counters["loop_s"] = loop_s;  // pieces/s times this: pieces in the time of the loop, on any machine
  state.counters["motion_s"] = stats.time_s;
  state.counters["x_real_time"] = benchmark::Counter(runs * stats.time_s, benchmark::Counter::kIsRate);
  state.counters["intervals/piece"] = static_cast<double>(stats.intervals) / count;
  state.counters["steps/window"] = static_cast<double>(stats.iterations) / static_cast<double>(stats.windows);
  state.counters["fallbacks"] = static_cast<double>(stats.fallbacks);
}

void five_axis_short_pieces(benchmark::State& state) {
  std::mt19937_64 rng(5);
  plan_all(state, blended(random_vertices(rng, 500, 0.5, 0.004), 0.2), cradle_joints(), TrunnionMap());
}
BENCHMARK(five_axis_short_pieces)->Unit(benchmark::kMillisecond);

void three_axis_corners(benchmark::State& state) {
  std::mt19937_64 rng(6);
  plan_all(state, blended(random_vertices(rng, 300, 3, 0), 0.2), linear_joints(3), IdentityMap({kX, kY, kZ}));
}
BENCHMARK(three_axis_corners)->Unit(benchmark::kMillisecond);

// 200 mm of a smooth five-axis curve in pieces of that many micrometres, as surface passes give them: at 50,
// 2 ms of motion hold 4 pieces.
void smooth_pieces(benchmark::State& state) {
  const double size = 1e-3 * static_cast<double>(state.range(0));
  std::vector<PathPiece> pieces;
  const auto point = [](double s) {
    PathPoint p;
    p.y = p.d1 = p.d2 = p.d3 = Words::Zero();
    p.y << s, 8 * std::sin(s / 8), std::cos(s / 16), 0.02 * std::sin(s / 10), 0, 0.05 * std::sin(s / 20);
    p.d1 << 1, std::cos(s / 8), -std::sin(s / 16) / 16, 0.002 * std::cos(s / 10), 0,
        0.0025 * std::cos(s / 20);
    p.d2 << 0, -std::sin(s / 8) / 8, -std::cos(s / 16) / 256, -0.0002 * std::sin(s / 10), 0,
        -0.000125 * std::sin(s / 20);
    p.d3 << 0, -std::cos(s / 8) / 64, std::sin(s / 16) / 4096, -0.00002 * std::cos(s / 10), 0,
        -6.25e-6 * std::cos(s / 20);
    return p;
  };
  for (int i = 0; i < static_cast<int>(200 / size + 0.5); ++i)
    pieces.push_back(make_hermite(point(i * size), point((i + 1) * size), size));
  plan_all(state, pieces, cradle_joints(), TrunnionMap());
}
BENCHMARK(smooth_pieces)->Arg(50)->Arg(250)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trn::speed_test

BENCHMARK_MAIN();
