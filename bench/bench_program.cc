// Whole programs from text to motion blocks, as a user meets the planner: blocks of the program per second of
// processor time on one core, latency to the first block, how far planning is ahead of the motion.
//   bench_program                     generated five-axis passes, the impeller
//   TRN_PROGRAM=FILE.ngc TRN_MACHINE=CFG bench_program --benchmark_filter=given
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "bench/processor_time.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/plan/speed/speed_options.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// Five-axis passes over a wavy surface, there and back, the tool along the normal: `moves` chords of
/// `chord_mm`.
std::string surface_passes(double chord_mm, int moves) {
  std::string text = "G21 G90 G94 G17\nG64 P0.01 R0.1\nG10 L2 P1 X0 Y0 Z40\nG54\nM428\n";
  const double length = 60;
  double x = -length / 2, y = -20, sense = 1;
  const auto height = [](double u, double v) { return 4 * std::sin(u / 9) + 2 * std::cos(v / 7 + u / 23); };
  for (int i = 0; i < moves; ++i) {
    const double dx = 4.0 / 9 * std::cos(x / 9) - 2.0 / 23 * std::sin(y / 7 + x / 23);
    const double dy = -2.0 / 7 * std::sin(y / 7 + x / 23);
    const double tilt = 20 + 8 * dy + 3 * std::sin(x / 11), turn = 30 + 12 * dx;
    text += fmt::format("{}X{:.4f} Y{:.4f} Z{:.4f} A{:.4f} C{:.4f}{}\n",
                        i == 0   ? "G0 "
                        : i == 1 ? "G1 "
                                 : "",
                        x, y, height(x, y), tilt, turn, i == 1 ? " F6000" : "");
    const double next = x + sense * chord_mm / std::hypot(1, dx);
    if (std::abs(next) < length / 2) {
      x = next;
    } else {
      y += 0.5;
      sense = -sense;
    }
  }
  return text + "M2\n";
}

void plan(benchmark::State& state, const std::string& config, ProgramStart start, const std::string& tools) {
  const Assembly assembly = assemble(config);
  start.q = JointVec::Zero(assembly.map->joint_count());
  SpeedStats stats;
  double first_s = 0, motion_s = 0, loop_s = calibration_s(), spent_s = 0;
  std::uint64_t blocks = 0;
  for (auto _ : state) {
    Parameters parameters;
    ToolTable table = tools.empty() ? ToolTable() : ToolTable::load(tools);
    const double begin_s = processor_s();
    Pipeline pipeline(assembly, parameters, table, start, {});
    MotionBlock block;
    first_s = motion_s = 0;
    while (pipeline.next(block)) {
      for (int i = 0; i < block.segment_count; ++i)
        motion_s += block.segments[static_cast<size_t>(i)].duration_s;
      if (first_s == 0 && motion_s > 0) first_s = processor_s() - begin_s;
    }
    spent_s += processor_s() - begin_s;
    stats = pipeline.speed_stats();
    blocks = pipeline.blocks_read();
  }
  loop_s = std::min(loop_s, calibration_s());
  const double runs = static_cast<double>(state.iterations()), count = static_cast<double>(blocks);
  const double intervals = static_cast<double>(stats.intervals), windows = static_cast<double>(stats.windows);
  state.counters["blocks/s"] = runs * count / spent_s;
  state.counters["blocks/loop"] = runs * count / spent_s * loop_s;
  state.counters["x_real_time"] = runs * motion_s / spent_s;
  state.counters["motion_s"] = motion_s;
  state.counters["first_ms"] = 1e3 * first_s;
  state.counters["us/interval"] = 1e6 * spent_s / runs / intervals;
  state.counters["intervals/block"] = intervals / count;
  state.counters["rounds/window"] = static_cast<double>(stats.rounds) / windows;
  state.counters["steps/window"] = static_cast<double>(stats.iterations) / windows;
  state.counters["stops"] = static_cast<double>(stats.fallbacks);
}

void surface(benchmark::State& state) {
  const double chord_mm = 1e-3 * static_cast<double>(state.range(0));
  const int moves = static_cast<int>(1500 / chord_mm);
  plan(state, source_dir() + "/configs/cradle.toml", {"passes.ngc", surface_passes(chord_mm, moves), {}}, "");
}
BENCHMARK(surface)->Arg(100)->Arg(200)->Arg(500)->Unit(benchmark::kMillisecond);

void impeller(benchmark::State& state) {
  plan(state, source_dir() + "/configs/cradle.toml",
       {source_dir() + "/examples/impeller.ngc", std::nullopt, {}}, source_dir() + "/examples/tools.tbl");
}
BENCHMARK(impeller)->Unit(benchmark::kMillisecond);

void given(benchmark::State& state) {
  const char *program = std::getenv("TRN_PROGRAM"), *machine = std::getenv("TRN_MACHINE");
  if (program == nullptr) return state.SkipWithError("TRN_PROGRAM names no program");
  plan(state, machine != nullptr ? machine : source_dir() + "/configs/cradle.toml",
       {program, std::nullopt, {}}, "");
}
BENCHMARK(given)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
