// The tick: its distribution over a five-axis program, and planning beside it.
//   bench_cycle
//   valgrind --tool=callgrind --toggle-collect='trn::Cycle::tick()' bench_cycle --benchmark_min_time=0.001
//   (instructions collected / ticks reported = instructions per tick)
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>

#include "kernel/cycle.h"
#include "kernel/pipeline.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

constexpr int kTicks = 20000;

void ticks_of_impeller(benchmark::State& state) {
  const std::string source = source_dir();
  std::vector<double> ns;
  for (auto _ : state) {
    Assembly assembly = assemble(source + "/configs/cradle.toml");
    Parameters parameters;
    ToolTable tools = ToolTable::load(source + "/examples/tools.tbl");
    MotionQueue queue(1 << 14);
    Cycle cycle({assembly.machine.period_s, assembly.machine.joints, {}, false, 8, assembly.plan_joints},
                *assembly.map, queue, *assembly.drives, assembly.corrections.setpoint.get());
    assembly.drives->bring_up();
    while (cycle.last_report().drives != DriveState::kEnabled) cycle.tick();
    Pipeline pipeline(assembly, parameters, tools,
                      {source + "/examples/impeller.ngc", std::nullopt, cycle.last_report().q_plan}, {});
    cycle.post({RtCommand::Kind::kStart});
    MotionBlock block;
    for (int i = 0; i < kTicks; ++i) {
      while (queue.buffered_s() < 1.0 && pipeline.next(block)) queue.push(block);
      const auto start = std::chrono::steady_clock::now();
      cycle.tick();
      ns.push_back(
          std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
    }
  }
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double share) {
    return ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))];
  };
  state.counters["ticks"] = static_cast<double>(ns.size());
  state.counters["p50_ns"] = at(0.5);
  state.counters["p99_9_ns"] = at(0.999);
  state.counters["max_ns"] = ns.back();
}
BENCHMARK(ticks_of_impeller)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
