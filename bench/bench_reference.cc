// What a computer is worth: bench/record.py divides all other times by this one.
#include <benchmark/benchmark.h>

#include "bench/processor_time.h"

namespace {

void reference(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(trn::calibration_s());
}
BENCHMARK(reference)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
