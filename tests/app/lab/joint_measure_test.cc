#include "app/lab/joint_measure.h"

#include <gtest/gtest.h>

#include "core/config.h"
#include "tests/support/paths.h"

// Scale errors of the rail mill: measured through the whole kernel, found again, corrected.
namespace trn {
namespace {

constexpr double kSlopes[] = {-0.00025, -0.003, 0.0014, 0.0001};

struct Measured {
  JointMeasurements before, after;
};

Measured measure_rails(double noise_mm, double resolution_mm) {
  const std::string config_path = source_dir() + "/configs/rail_mill_measured.toml";
  Assembly plain = assemble(config_path), corrected = assemble(config_path);
  const ConfigTable root = load_config(source_dir() + "/examples/rail_errors.toml");
  const auto truth = read_joint_tables(plain.machine, root.table("corrections").table("joint_table"));
  JointMeasureConfig config;
  std::tie(config.from, config.to) = word_range(plain, kX);
  config.places = 13;
  config.passes = 1;
  config.noise = noise_mm;
  config.resolution = resolution_mm;
  const std::string program = testing::TempDir() + "/measure.ngc";
  Measured out;
  out.before = measure_joints(plain, truth, config, false, program);
  config.seed = 2;
  out.after = measure_joints(corrected, truth, config, true, program);
  return out;
}

TEST(JointMeasure, SlopesOfTheRailsComeBackExactlyWithoutNoise) {
  const Measured rails = measure_rails(0, 0);
  ASSERT_EQ(rails.before.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    ASSERT_EQ(rails.before[i].size(), 26u);
    const JointTableFit fit = fit_joint_table(rails.before[i], 0);
    EXPECT_NEAR(fit.slope, kSlopes[i], 1e-10);
    EXPECT_NEAR(fit.backlash, 0, 1e-8);
    // The way of the rail times its slope, and nothing with correction.
    const double way = std::abs(rails.before[i].front().commanded - rails.before[i][12].commanded);
    EXPECT_NEAR(error_amplitude(rails.before[i]), std::abs(1 / (1 + kSlopes[i]) - 1) * way / 2, 1e-6);
    EXPECT_LT(error_amplitude(rails.after[i]), 1e-7);
  }
}

TEST(JointMeasure, SlopesOfTheRailsComeBackFromNoisyScales) {
  const Measured rails = measure_rails(0.005, 0.01);
  for (std::size_t i = 0; i < 4; ++i) {
    const JointTableFit fit = fit_joint_table(rails.before[i], 0);
    std::printf("rail %zu: slope %.7f +- %.1e for %.5f; error up to %.4f mm, corrected %.4f mm\n", i + 1,
                fit.slope, fit.slope_deviation, kSlopes[i], error_amplitude(rails.before[i]),
                error_amplitude(rails.after[i]));
    EXPECT_NEAR(fit.slope, kSlopes[i], 4 * fit.slope_deviation);
    EXPECT_LT(fit.slope_deviation, 6e-6);
    EXPECT_LT(error_amplitude(rails.after[i]), 0.03);  // 4 sigma of noise and half a step of the scale
  }
}

}  // namespace
}  // namespace trn
