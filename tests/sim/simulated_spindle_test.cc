#include "sim/simulated_spindle.h"

#include <gtest/gtest.h>

#include <cmath>

namespace trn {
namespace {

constexpr double kPeriod_s = 0.001;

struct Bench {
  explicit Bench(const SimulatedSpindle::Config& config) : spindle(config) {}
  /// One period; the speed in it, rpm.
  double step() {
    const double before = inputs.spindle_turns;
    spindle.step(outputs, inputs);
    return (inputs.spindle_turns - before) / kPeriod_s * 60;
  }
  SimulatedSpindle spindle;
  IoOutputs outputs;
  IoInputs inputs;
};

TEST(SimulatedSpindle, WithoutARampItTurnsAsToldAtOnce) {
  Bench bench({});
  for (const double rpm : {6000.0, -1500.0, 0.0}) {
    bench.outputs.spindle_rpm = rpm;
    EXPECT_NEAR(bench.step(), rpm, 1e-9);
    EXPECT_TRUE(bench.inputs.spindle_ready);
  }
}

// 2000 rpm/s: from rest to 3000 rpm in 1.5 s, ready at 99 % of it, and to -1000 rpm in 2 s more.
TEST(SimulatedSpindle, TheRampTakesItsTime) {
  SimulatedSpindle::Config config;
  config.acceleration_rpm_s = 2000;
  Bench bench(config);
  bench.outputs.spindle_rpm = 3000;
  int ready_at = 0;
  for (int k = 1; k <= 2000; ++k) {
    ASSERT_NEAR(bench.step(), std::min(2.0 * k, 3000.0), 1e-6) << k;
    if (bench.inputs.spindle_ready && ready_at == 0) ready_at = k;
    ASSERT_EQ(bench.inputs.spindle_ready, ready_at != 0) << k;
  }
  EXPECT_NEAR(ready_at, 0.99 * 1500, 1);
  bench.outputs.spindle_rpm = -1000;
  for (int k = 1; k <= 2500; ++k) {
    ASSERT_NEAR(bench.step(), std::max(3000 - 2.0 * k, -1000.0), 1e-6) << k;
    ASSERT_TRUE(std::abs(k - 1995) <= 1 || bench.inputs.spindle_ready == (k > 1995)) << k;
  }
}

// A first-order lag behind a step: n (1 - exp(-t / lag)).
TEST(SimulatedSpindle, TheLagIsOfFirstOrder) {
  SimulatedSpindle::Config config;
  config.lag_s = 0.08;
  Bench bench(config);
  bench.outputs.spindle_rpm = 1200;
  for (int k = 1; k <= 1000; ++k)
    ASSERT_NEAR(bench.step(), 1200 * (1 - std::exp(-k * kPeriod_s / 0.08)), 1e-6) << k;
}

// Speed n (1 + s sin(2 pi f t)): after half a wave it is ahead by n s / (pi f), after a whole one by nothing.
TEST(SimulatedSpindle, AnUnevenLoadWavesTheSpeed) {
  SimulatedSpindle::Config config;
  config.load_share = 0.2;
  config.load_hz = 2;
  Bench bench(config);
  bench.outputs.spindle_rpm = 600;
  for (int k = 1; k <= 250; ++k) bench.step();
  const double ahead = 10 * 0.2 / (std::acos(-1.0) * 2);
  EXPECT_NEAR(bench.inputs.spindle_turns, 10 * 0.25 + ahead, 1e-5);
  EXPECT_TRUE(bench.inputs.spindle_ready);
  for (int k = 1; k <= 250; ++k) bench.step();
  EXPECT_NEAR(bench.inputs.spindle_turns, 10 * 0.5, 1e-9);
}

// It looks for its place at 30 rpm, 180 degrees a second, by the shorter way.
TEST(SimulatedSpindle, FromRestItGoesTheShorterWayToItsPlace) {
  struct Row {
    double deg, way_deg;
  };
  for (const Row& row :
       {Row{90, 90}, Row{270, -90}, Row{-90, -90}, Row{170, 170}, Row{200, -160}, Row{720, 0}}) {
    Bench bench({});
    bench.outputs.spindle_orients = true;
    bench.outputs.spindle_deg = row.deg;
    int periods = 0;
    while (!bench.inputs.spindle_ready || periods == 0) {
      ASSERT_LE(std::abs(bench.step()), 30 + 1e-6);
      ASSERT_LT(++periods, 2000);
    }
    EXPECT_NEAR(360 * bench.inputs.spindle_turns, row.way_deg, 1e-6) << row.deg;
    EXPECT_NEAR(periods, std::abs(row.way_deg) / 180 / kPeriod_s, 2) << row.deg;
    for (int k = 0; k < 100; ++k) EXPECT_NEAR(bench.step(), 0, 1e-6);
    EXPECT_TRUE(bench.inputs.spindle_ready);
  }
}

TEST(SimulatedSpindle, OutOfTheCutItSlowsDownBeforeItLooksForItsPlace) {
  SimulatedSpindle::Config config;
  config.acceleration_rpm_s = 2000;
  for (const double sense : {1.0, -1.0}) {
    Bench bench(config);
    bench.outputs.spindle_rpm = sense * 600;
    for (int k = 0; k < 500; ++k) bench.step();
    bench.outputs = {};
    bench.outputs.spindle_orients = true;
    bench.outputs.spindle_deg = 30;
    for (int k = 1; k < 285; ++k) {
      ASSERT_NEAR(bench.step(), sense * (600 - 2.0 * k), 1e-6) << k;
      ASSERT_FALSE(bench.inputs.spindle_ready);
    }
    for (int k = 0; k < 1010; ++k) ASSERT_LE(std::abs(bench.step()), 32 + 1e-6);
    EXPECT_NEAR(std::remainder(360 * bench.inputs.spindle_turns - 30, 360), 0, 1e-6);
    EXPECT_TRUE(bench.inputs.spindle_ready);
    bench.outputs = {};
    bench.outputs.spindle_rpm = 100;  // from where it stands: at rest, so the ramp begins at nothing
    EXPECT_NEAR(bench.step(), 2, 1e-6);
  }
}

}  // namespace
}  // namespace trn
