#include <benchmark/benchmark.h>

#include "compensation/micromill/deflection_estimator.h"
#include "compensation/micromill/friction_network.h"
#include "compensation/micromill/load_observer.h"
#include "sim/micromill/micro_mill_plant.h"
#include "sim/micromill/part_surface.h"

namespace trn {
namespace {

FrictionNetwork some_network() {
  FrictionNetwork::Shape shape;
  std::vector<double> weights(static_cast<std::size_t>(shape.weight_count()));
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 0.01 * static_cast<double>(i % 17) - 0.08;
  return {shape, weights};
}

/// What the estimator adds to a tick: two load filters, two networks, the innovation's monitor.
void deflection_estimate(benchmark::State& state) {
  DeflectionEstimator::Config config;
  config.period_s = 0.001;
  const MotorModel motors[] = {{2010, 3.89, 2}, {689, 10.2, 6}};
  const LoadNoise noises[] = {{0.01642, 130.27, 1.6229e-4}, {0.009218, 92.79, 1.8562e-4}};
  for (std::size_t i = 0; i < 2; ++i) {
    config.axes[i].observer = {motors[i], noises[i], 0.001, 1};
    config.axes[i].network = some_network();
    config.axes[i].stiffness_N_mm = 50;
    config.axes[i].innovation_rms_max_mm = 1;
  }
  const DeflectionEstimator estimator(config);
  DeflectionEstimator::State memory;
  DeflectionEstimator::Output out;
  double x = 0;
  for (auto _ : state) {
    x += 0.005;
    estimator.step({0.5, 0.6}, {x, -x}, memory, out);
    benchmark::DoNotOptimize(out);
  }
}
BENCHMARK(deflection_estimate);

/// A period of the simulated stage in the cut.
void micro_mill_plant_period(benchmark::State& state) {
  MicroMillPlant plant(micro_mill_plant(0, 0.001));
  plant.clamp(PartSurface::Config{});
  double x = 0;
  for (auto _ : state) plant.step({x += 0.0048, 12.8, -0.3});
}
BENCHMARK(micro_mill_plant_period)->Iterations(2000);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
