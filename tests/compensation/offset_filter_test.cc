#include "compensation/offset_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

// Whatever a correction asks for, the motion it gets stays inside its reserve.
namespace trn {
namespace {

constexpr double kT = 0.001, kLimit = 0.1, kV = 5, kA = 50, kJ = 1000;

struct Peaks {
  double value = 0, v = 0, a = 0, j = 0;
};

Peaks peaks_of(const std::vector<double>& targets) {
  OffsetFilter filter(kLimit, kV, kA, kJ, kT);
  std::vector<double> y(4, 0.0);
  for (const double target : targets) y.push_back(filter.step(target));
  Peaks out;
  for (std::size_t i = 3; i < y.size(); ++i) {
    out.value = std::max(out.value, std::abs(y[i]));
    out.v = std::max(out.v, std::abs(y[i] - y[i - 1]) / kT);
    out.a = std::max(out.a, std::abs(y[i] - 2 * y[i - 1] + y[i - 2]) / (kT * kT));
    out.j = std::max(out.j, std::abs(y[i] - 3 * y[i - 1] + 3 * y[i - 2] - y[i - 3]) / (kT * kT * kT));
  }
  return out;
}

void expect_inside(const Peaks& p) {
  EXPECT_LE(p.value, kLimit * (1 + 1e-9));
  EXPECT_LE(p.v, kV * (1 + 1e-9));
  EXPECT_LE(p.a, kA * (1 + 1e-9));
  EXPECT_LE(p.j, kJ * (1 + 1e-9));
}

TEST(OffsetFilter, AnyTargetsStayInsideTheReserve) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(-5 * kLimit, 5 * kLimit);
    std::uniform_int_distribution<int> length(1, 1 + static_cast<int>(seed * seed));
    std::vector<double> targets;
    while (targets.size() < 4000)
      targets.insert(targets.end(), static_cast<std::size_t>(length(random)), value(random));
    targets[100] = std::nan("");
    expect_inside(peaks_of(targets));
  }
}

TEST(OffsetFilter, TheWorstSequenceOfTargetsReachesTheReserve) {
  // The worst targets follow the sign of the reversed third difference of the impulse response.
  OffsetFilter probe(kLimit, kV, kA, kJ, kT);
  std::vector<double> h(4, 0.0);
  for (int i = 0; i < 2000; ++i) h.push_back(probe.step(i == 0 ? kLimit : 0));
  std::vector<double> worst;
  for (std::size_t i = h.size() - 1; i >= 4; --i)
    worst.push_back(std::copysign(kLimit, h[i] - 3 * h[i - 1] + 3 * h[i - 2] - h[i - 3]));
  const Peaks p = peaks_of(worst);
  expect_inside(p);
  EXPECT_GT(p.j, 0.99 * kJ);
}

TEST(OffsetFilter, AJumpElsewhereIsTakenUpAtRest) {
  OffsetFilter filter(kLimit, kV, kA, kJ, kT);
  for (int i = 0; i < 5000; ++i) filter.step(0.02);
  EXPECT_NEAR(filter.value(), 0.02, 1e-12);
  filter.shift(0.05);
  EXPECT_NEAR(filter.step(0.07), 0.07, 1e-12);
  double last = 0.07, fastest = 0;
  for (int i = 0; i < 5000; ++i) {
    const double now = filter.step(0);
    fastest = std::max(fastest, (last - now) / kT);
    last = now;
  }
  EXPECT_LE(fastest, kV);
  EXPECT_NEAR(last, 0, 1e-12);
}

}  // namespace
}  // namespace trn
