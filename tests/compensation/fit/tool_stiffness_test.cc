#include "compensation/fit/tool_stiffness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace trn {
namespace {

TEST(ToolStiffness, FindsTheLine) {
  std::vector<double> x, f;
  for (int i = 0; i < 100; ++i) {
    x.push_back(27 + 0.001 * i);
    f.push_back(55 * (x.back() - 26.98) + (i % 2 ? 0.1 : -0.1));
  }
  const StiffnessFit fit = fit_stiffness(x, f);
  EXPECT_NEAR(fit.stiffness_N_mm, 55, 3 * fit.sigma_N_mm);
  EXPECT_NEAR(fit.contact_mm, 26.98, 1e-3);
  EXPECT_NEAR(fit.rms_N, 0.1, 1e-3);
  EXPECT_NEAR(fit.sigma_N_mm, 0.1 / std::sqrt(100 * (0.1 * 0.1 / 12)), 0.02);
}

// Deviations 1, -2, 1 from a line of slope 10: their sum of squares 6 over 1 degree of freedom, over a spread
// of 2.
TEST(ToolStiffness, ThreeSamplesAreEnough) {
  const StiffnessFit fit = fit_stiffness({1, 2, 3}, {11, 18, 31});
  EXPECT_NEAR(fit.stiffness_N_mm, 10, 1e-12);
  EXPECT_NEAR(fit.contact_mm, 0, 1e-12);
  EXPECT_NEAR(fit.rms_N, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(fit.sigma_N_mm, std::sqrt(3.0), 1e-12);
}

TEST(ToolStiffness, RefusesWhatIsNoLine) {
  EXPECT_THROW(fit_stiffness({1, 2}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(fit_stiffness({1, 1, 1}, {1, 2, 3}), std::invalid_argument);
}

}  // namespace
}  // namespace trn
