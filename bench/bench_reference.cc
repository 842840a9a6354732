// What a computer is worth: a fixed piece of work of the kind that this kernel does, which nobody changes.
// bench/record.py divides all other times by this one.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Small dense algebra, angles, and reads all over two megabytes.
void reference(benchmark::State& state) {
  std::vector<std::uint32_t> places(1u << 19);
  for (std::size_t i = 0; i < places.size(); ++i)
    places[i] = static_cast<std::uint32_t>((i * 2654435761u + 12345u) % places.size());
  std::uint32_t place = 0;
  for (auto _ : state) {
    Matrix6 A = Matrix6::Identity() * 10;
    Vector6 x = Vector6::Ones();
    for (int i = 0; i < 100; ++i) {
      A(i % 6, (i * 5) % 6) += 0.01;
      x = (A.transpose() * A).llt().solve(x).normalized();
    }
    double turned = 0;
    for (int i = 0; i < 700; ++i) turned += std::sin(i + x[0]) * std::cos(turned);
    for (int i = 0; i < 4000; ++i) place = places[place] ^ (static_cast<std::uint32_t>(i) & 1023u);
    benchmark::DoNotOptimize(x);
    benchmark::DoNotOptimize(turned);
    benchmark::DoNotOptimize(place);
  }
}

BENCHMARK(reference);

}  // namespace

BENCHMARK_MAIN();
