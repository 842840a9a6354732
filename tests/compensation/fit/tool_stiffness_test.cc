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

TEST(ToolStiffness, RefusesWhatIsNoLine) {
  EXPECT_THROW(fit_stiffness({1, 2}, {1, 2}), std::invalid_argument);
  EXPECT_THROW(fit_stiffness({1, 1, 1}, {1, 2, 3}), std::invalid_argument);
}

}  // namespace
}  // namespace trn
