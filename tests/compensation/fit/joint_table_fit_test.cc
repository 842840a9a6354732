#include "compensation/fit/joint_table_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

// Axes whose errors are known exactly.
namespace trn {
namespace {

/// There and back between 0 and 100 in steps of 10; backward reached by `gap` more.
std::vector<AxisMeasurement> there_and_back(double s, double datum, double gap) {
  std::vector<AxisMeasurement> out;
  for (int i = 0; i <= 10; ++i) out.push_back({10.0 * i, 10.0 * i * (1 + s) + datum - gap / 2});
  for (int i = 9; i >= 0; --i) out.push_back({10.0 * i, 10.0 * i * (1 + s) + datum + gap / 2});
  return out;
}

TEST(JointTableFit, LineAndBacklashAreFoundExactly) {
  const JointTableFit fit = fit_joint_table(there_and_back(2e-4, 0.05, 0.012), 0);
  EXPECT_NEAR(fit.slope, 1 / (1 + 2e-4) - 1, 1e-12);
  EXPECT_NEAR(fit.backlash, 0.012, 1e-12);
  EXPECT_NEAR(fit.datum, 0.05, 1e-12);
  EXPECT_NEAR(fit.rms, 0, 1e-12);
  EXPECT_EQ(fit.direction.front(), 1);
  EXPECT_EQ(fit.direction.back(), -1);
  EXPECT_TRUE(fit.at.empty());
}

TEST(JointTableFit, OneDirectionKnowsNoBacklash) {
  for (const bool back : {false, true}) {
    std::vector<AxisMeasurement> way;
    for (int i = 0; i <= 10; ++i) {
      const double at = back ? 100 - 10.0 * i : 10.0 * i;
      way.push_back({at, at * (1 - 1e-4) + 0.02 + 1e-3 * std::sin(at / 20)});
    }
    const JointTableFit fit = fit_joint_table(way, 11);
    EXPECT_EQ(fit.backlash, 0);
    EXPECT_EQ(fit.backlash_deviation, 0);
    EXPECT_GT(fit.slope_deviation, 0);
    ASSERT_EQ(fit.at.size(), 11u);
    EXPECT_EQ(fit.forward, fit.backward);
    for (std::size_t k = 0; k < 11; ++k)
      EXPECT_NEAR(fit.forward[k], -1e-4 * fit.at[k] + 0.02 + 1e-3 * std::sin(fit.at[k] / 20) - fit.datum,
                  1e-12);
  }
}

TEST(JointTableFit, ATableHasBothDirections) {
  const JointTableFit fit = fit_joint_table(there_and_back(0, 0, 0.01), 6);
  EXPECT_EQ(fit.at, (std::vector<double>{0, 20, 40, 60, 80, 100}));
  for (std::size_t k = 0; k + 1 < 6; ++k) {  // at 100 it was turned round: forward only
    EXPECT_NEAR(fit.forward[k], -0.005, 1e-12) << k;
    EXPECT_NEAR(fit.backward[k], 0.005, 1e-12) << k;
  }
}

// An axis whose range does not begin at 0, as most do not; its error has a bend at one of the table's places.
TEST(JointTableFit, ARangeMayBeginAnywhere) {
  const auto error = [](double at) { return 1e-4 * std::abs(at - 85); };
  std::vector<AxisMeasurement> way;
  for (int at = 35; at <= 135; at += 5) way.push_back({1.0 * at, at + error(at)});
  const JointTableFit fit = fit_joint_table(way, 5);
  EXPECT_EQ(fit.at, (std::vector<double>{35, 60, 85, 110, 135}));
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(fit.forward[k], error(fit.at[k]) - fit.datum, 1e-12) << k;
}

TEST(JointTableFit, AMeasurementAtTheSamePlaceKeepsTheDirection) {
  const JointTableFit fit = fit_joint_table({{0, 0}, {1, 1}, {1, 1}, {0, 0.1}, {0, 0.1}}, 0);
  EXPECT_EQ(fit.direction, (std::vector<int>{1, 1, 1, -1, -1}));
}

TEST(JointTableFit, TooLittleIsRefused) {
  EXPECT_THROW(fit_joint_table({{0, 0}, {1, 1}, {2, 2}}, 0), std::invalid_argument);
  EXPECT_THROW(fit_joint_table({{1, 0}, {1, 1}, {1, 2}, {1, 2}}, 0), std::invalid_argument);
  EXPECT_THROW(fit_joint_table(there_and_back(0, 0, 0), 40), std::invalid_argument);
}

}  // namespace
}  // namespace trn
