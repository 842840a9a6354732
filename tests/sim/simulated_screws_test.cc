#include "sim/simulated_screws.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace trn {
namespace {

constexpr double kPeriod_s = 0.125;  // eight make a second to the bit

// A metre of screw that loses no heat, and is heated by its nut alone; from `fixed` on.
SimulatedScrewConfig screw(int joint, double fixed_mm, double far_mm) {
  SimulatedScrewConfig config;
  config.screw.joint = joint;
  config.screw.fixed_bearing_mm = fixed_mm;
  config.screw.far_bearing_mm = far_mm;
  config.screw.heat.cooling_W_m2K = 0;
  config.screw.heat.bearing_friction_N = 0;
  return config;
}

// Heat E stretches a free screw by alpha E / (rho c A), however it is spread. Joint scales run either way.
TEST(SimulatedScrews, GrowByTheHeatOfTheirNuts) {
  SensorBoard board;
  SimulatedScrews screws({screw(0, 0, 1000), screw(2, 1000, 0)}, kPeriod_s, board);
  const auto at = [](double x_mm) { return JointVec(Eigen::Vector3d(x_mm, 77, 1000 - x_mm)); };
  const int seconds = 40;
  for (int k = 0; k < 8 * seconds; ++k) screws.step(at(k % 2 ? 600 : 400), at(k % 2 ? 600 : 400));
  const double way_m = 0.2 * (8 * seconds - 1);
  const double heat_J_Km = 7850 * 460 * std::acos(-1.0) * 0.04 * 0.04 / 4;
  const double grown_mm = 1000 * 11.7e-6 * 120 * way_m / heat_J_Km;
  screws.step(at(1000), at(1000 - grown_mm));
  for (const SimulatedScrews::Report& report : screws.reports()) {
    EXPECT_NEAR(report.worst.without, grown_mm, 1e-9) << report.joint;
    EXPECT_LT(report.worst.left, grown_mm * 0.76)
        << "at 600, with half of the heat below and half of the rest";
    EXPECT_GT(report.rise_K, 0);
  }
  EXPECT_EQ(screws.reports()[0].joint, 0);
  EXPECT_EQ(screws.reports()[1].joint, 2);
  EXPECT_NEAR(screws.reports()[0].rise_K, screws.reports()[1].rise_K, 1e-9);
}

// A setpoint that takes the growth off leaves nothing; one that adds it leaves it twice.
TEST(SimulatedScrews, WhatIsLeftIsJudgedAtTheSetpoint) {
  for (const double sign : {-1.0, 1.0}) {
    SensorBoard board;
    SimulatedScrews warm({screw(0, 0, 1000)}, kPeriod_s, board);
    const auto at = [](double x_mm) { return JointVec(Eigen::Vector3d(x_mm, 0, 0)); };
    for (int k = 0; k < 80; ++k) warm.step(at(k % 2 ? 60 : 40), at(k % 2 ? 60 : 40));
    const double before = warm.reports()[0].worst.left;
    const double grown_mm = 1000 * 11.7e-6 * 120 * 0.02 * 79 / (7850 * 460 * std::acos(-1.0) * 0.0004);
    warm.step(at(900), at(900 + sign * grown_mm));
    const double left = warm.reports()[0].worst.left;
    EXPECT_NEAR(left, sign < 0 ? before : 2 * grown_mm, 1e-9);
    EXPECT_LT(before, grown_mm);
  }
}

TEST(SimulatedScrews, TheSensorTellsItsPlaceOnceASecond) {
  SensorBoard board;
  SimulatedScrewConfig config = screw(0, 0, 1000);
  config.screw.sensor.channel = board.channel("nut");
  config.screw.sensor.at_mm = 501;
  config.screw.sensor.reference_C = 18;
  config.silent_from_s = 5;
  config.silent_to_s = 8;
  SimulatedScrewConfig coarse = config;
  coarse.screw.sensor.channel = board.channel("coarse");
  coarse.resolution_K = 0.25;
  SimulatedScrews screws({config, coarse}, kPeriod_s, board);
  std::vector<double> told_s, told_C, coarse_C;
  for (int k = 1; k <= 96; ++k) {
    const JointVec q = Eigen::Vector3d(k % 2 ? 498 : 502, 0, 0);  // within the node at 500
    screws.step(q, q);
    for (int look = 0; look < 2; ++look) {
      const SensorSample sample = board.listen();
      if (sample.channel == 0) told_s.push_back(k * kPeriod_s);
      if (sample.channel == 0) told_C.push_back(sample.value);
      if (sample.channel == 1) coarse_C.push_back(sample.value);
    }
  }
  EXPECT_EQ(told_s, (std::vector<double>{1, 2, 3, 4, 8, 9, 10, 11, 12}));
  ASSERT_EQ(coarse_C.size(), told_C.size());
  EXPECT_NEAR(told_C.back(), 18 + screws.reports()[0].rise_K, 1e-12) << "the warmest place";
  EXPECT_GT(told_C.back(), told_C.front() + 0.1);
  for (std::size_t i = 0; i < told_C.size(); ++i) {
    EXPECT_NEAR(coarse_C[i], told_C[i], 0.125 + 1e-12);
    EXPECT_EQ(std::fmod(coarse_C[i], 0.25), 0);
  }
}

}  // namespace
}  // namespace trn
