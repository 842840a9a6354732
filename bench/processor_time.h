#pragma once

#include <benchmark/benchmark.h>

#include <cmath>
#include <ctime>

namespace trn {

/// What this thread has had of the processor.
inline double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Processor time of ten million dependent square roots and additions, to compare machines by.
inline double calibration_s() {
  const double start = processor_s();
  double x = 1;
  for (int i = 0; i < 10'000'000; ++i) x = std::sqrt(x + 1.5);
  benchmark::DoNotOptimize(x);
  return processor_s() - start;
}

}  // namespace trn
