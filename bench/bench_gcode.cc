#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <string>

#include "core/motion.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"

// Lines per second of the interpreter, text to planner moves.
namespace trn {
namespace {

class CountMoves : public MoveSink {
 public:
  void move(const ProgramMove&) override { ++moves; }
  void event(const QueueEvent&, SourceLine) override {}
  std::uint64_t moves = 0;
};

void run(benchmark::State& state, const std::string& program, double lines) {
  for (auto _ : state) {
    ProgramConfig config;
    Parameters parameters;
    ToolTable tools;
    CountMoves moves;
    Lowering lowering(config, nullptr, moves);
    Interpreter interpreter({config, parameters, tools, nullptr, lowering, {}});
    interpreter.open_text(program, "bench.ngc");
    while (interpreter.step()) {
    }
    benchmark::DoNotOptimize(moves.moves);
  }
  const auto passes = static_cast<double>(state.iterations());
  state.counters["lines/s"] = benchmark::Counter(lines * passes, benchmark::Counter::kIsRate);
  state.SetBytesProcessed(static_cast<std::int64_t>(passes * static_cast<double>(program.size())));
}

constexpr int kLines = 200000;

void BM_ThreeAxisLines(benchmark::State& state) {
  std::string program = "G21 G90 G1 F1000\n";
  for (int i = 0; i < kLines; ++i)
    program +=
        fmt::format("N{} X{:.3f} Y{:.3f} Z{:.3f}\n", i, (i % 997) * 0.1, (i % 331) * 0.07, -(i % 71) * 0.013);
  run(state, program + "M2\n", kLines);
}
BENCHMARK(BM_ThreeAxisLines)->Unit(benchmark::kMillisecond);

void BM_FiveAxisLines(benchmark::State& state) {
  std::string program = "G21 G90 G1 F1000\n";
  for (int i = 0; i < kLines; ++i)
    program += fmt::format("X{:.4f} Y{:.4f} Z{:.4f} A{:.4f} C{:.4f}\n", (i % 997) * 0.1, (i % 331) * 0.07,
                           -(i % 71) * 0.013, (i % 89) * 0.3, (i % 359) * 0.5);
  run(state, program + "M2\n", kLines);
}
BENCHMARK(BM_FiveAxisLines)->Unit(benchmark::kMillisecond);

void BM_LoopOfSines(benchmark::State& state) {
  run(state,
      fmt::format("G21 G90 G1 F1000\n#1=0\no100 while [#1 lt {}]\nG1 X[10*sin[#1]] Y[10*cos[#1]]\n#1=[#1+1]\n"
                  "o100 endwhile\nM2\n",
                  kLines),
      kLines);
}
BENCHMARK(BM_LoopOfSines)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
