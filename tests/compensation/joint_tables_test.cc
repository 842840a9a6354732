#include "compensation/joint_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "compensation/fit/joint_table_fit.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

TEST(JointTables, SlopesOfTheRailMill) {
  const auto vectors = load_vectors("rail");
  std::vector<JointTable> tables;
  for (int i = 0; i < 4; ++i) {
    JointTable table;
    table.joint = i;
    table.slope = vectors.at("slope")[static_cast<std::size_t>(i)];
    tables.push_back(table);
  }
  const JointTables correction(tables);
  for (const auto& row : vectors.at("rows")) {
    const JointVec rails = joints_of(row.at("rails"));
    JointVec q = rails;
    correction.correct(q);
    EXPECT_LT((q - joints_of(row.at("rails_slope_corrected"))).lpNorm<Eigen::Infinity>(), 1e-9);
    correction.undo(q);
    EXPECT_LT((q - rails).lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

JointTable wavy() {
  std::vector<double> at, mean, gap;
  for (int i = 0; i <= 20; ++i) {
    at.push_back(20.0 * i);
    mean.push_back(0.02 * std::sin(0.3 * i));
    gap.push_back(0.004 + 0.0001 * i);
  }
  JointTable table;
  table.mean = Spline(at, mean);
  table.half_gap = Spline(at, gap);
  return table;
}

TEST(JointTables, ATableIsTakenOff) {
  const JointTable table = wavy();
  const JointTables correction({table});
  for (double x = 5; x < 395; x += 7.3) {
    JointVec q(1);
    q << x;
    correction.correct(q);
    EXPECT_NEAR(q[0] + table.mean.at(x), x, 1e-12);  // the axis goes mean too far and stands right
    correction.undo(q);
    EXPECT_NEAR(q[0], x, 1e-9);
  }
}

TEST(JointTables, BacklashFollowsTheDirection) {
  JointTable table;
  table.backlash = 0.02;
  BacklashCorrection correction({table});
  JointVec q(1), offset = JointVec::Zero(1);
  Feedback feedback;
  const auto drive = [&](double to) {
    q[0] = to;
    correction.wanted({q, feedback}, offset);
    return offset[0];
  };
  drive(0);
  EXPECT_DOUBLE_EQ(drive(1), 0.01);
  EXPECT_DOUBLE_EQ(drive(2), 0.01);
  EXPECT_DOUBLE_EQ(drive(1.9995), 0.01);  // not yet a reversal
  EXPECT_DOUBLE_EQ(drive(1.99), -0.01);
  EXPECT_DOUBLE_EQ(drive(1.98), -0.01);
  EXPECT_DOUBLE_EQ(drive(1.99), 0.01);
}

TEST(JointTables, TheGapMayDependOnThePlace) {
  const JointTable table = wavy();
  BacklashCorrection correction({table});
  JointVec q(1), offset = JointVec::Zero(1);
  Feedback feedback;
  for (double x = 0; x < 300; x += 0.5) {
    q[0] = x;
    correction.wanted({q, feedback}, offset);
  }
  EXPECT_NEAR(offset[0], table.half_gap.at(299.5), 1e-12);
}

TEST(JointTables, BadTablesAreNamed) {
  const Machine machine = load_machine("rail_mill").machine;
  const auto message = [&](const std::string& text) {
    try {
      read_joint_tables(machine, parse_config(text, "t"));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string head = "[[joint]]\njoint = \"" + machine.joints[0].name + "\"\n";
  EXPECT_NE(message(head + "at_mm = [0, 10, 5]\nforward_mm = [0, 0, 0]\n").find("t:3:"), std::string::npos);
  EXPECT_NE(message(head + "at_mm = [0, 10]\nforward_mm = [0, 0, 0]\n").find("2 places"), std::string::npos);
  EXPECT_NE(message(head + "slope = 0.5\n").find("t:3:"), std::string::npos);
  EXPECT_NE(message(head + "at_mm = [0, 10]\nforward_mm = [0, 1]\n").find("steeper"), std::string::npos);
  EXPECT_EQ(message(head + "slope = -0.003\n"), "none");
}

// There and back in steps of 20 mm, read with 5 um of noise, on rails whose scale is wrong by -k / (1 + k).
TEST(JointTableFit, SlopesComeBackFromNoisyMeasurements) {
  std::mt19937 rng(3);
  std::normal_distribution<double> noise(0, 0.005);
  for (const double k : {-0.00025, -0.003, 0.0014, 0.0001}) {
    std::vector<AxisMeasurement> points;
    for (int i = 0; i <= 60; ++i) {
      const int place = i <= 30 ? i : 60 - i;
      const double commanded = 100 + 20 * place, backlash = i <= 30 ? -0.006 : 0.006;
      points.push_back({commanded, commanded / (1 + k) + backlash + noise(rng)});
    }
    const JointTableFit fit = fit_joint_table(points, 0);
    EXPECT_NEAR(fit.slope, k, 4 * fit.slope_deviation);
    EXPECT_LT(fit.slope_deviation, 5e-6);
    EXPECT_NEAR(fit.backlash, 0.012, 4 * fit.backlash_deviation);
  }
}

TEST(JointTableFit, TablesComeBackInBothDirections) {
  std::vector<AxisMeasurement> points;
  for (int i = 0; i <= 160; ++i) {
    const bool there = i <= 80;
    const double x = 5.0 * (there ? i : 160 - i), wave = 0.01 * std::sin(x / 60);
    points.push_back({x, x + wave + (there ? -0.003 : 0.003)});
  }
  const JointTableFit fit = fit_joint_table(points, 41);
  ASSERT_EQ(fit.at.size(), 41u);
  for (std::size_t i = 1; i + 1 < fit.at.size(); ++i) {
    const double wave = 0.01 * std::sin(fit.at[i] / 60);
    EXPECT_NEAR(fit.forward[i] + fit.datum, wave - 0.003, 2e-4);
    EXPECT_NEAR(fit.backward[i] + fit.datum, wave + 0.003, 2e-4);
  }
  EXPECT_THROW(fit_joint_table(points, 400), std::invalid_argument);
  EXPECT_THROW(fit_joint_table({{0, 0}, {1, 1}}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace trn
