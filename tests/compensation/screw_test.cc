#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "compensation/screw_correction.h"
#include "compensation/screw_heat.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "tests/compensation/true_screw.h"
#include "tests/kinematics/machines.h"

// Growth of ball screws: worked numbers, an independent heat equation as the truth, sensors that fail.
namespace trn {
namespace {

using test::TrueScrew;

double interpolate(const std::vector<double>& x, const std::vector<double>& y, double at) {
  std::size_t i = 0;
  while (i + 2 < x.size() && x[i + 1] < at) ++i;
  return y[i] + (y[i + 1] - y[i]) * (at - x[i]) / (x[i + 1] - x[i]);
}

TEST(Screw, DisplacementOfTheThreeMountings) {
  for (const auto& row : vector_rows("screw_thermal")) {
    const std::string mounting = row.at("mounting");
    const ScrewMounting m = mounting == "fixed-free"    ? ScrewMounting::kFixedFree
                            : mounting == "fixed-fixed" ? ScrewMounting::kFixedFixed
                                                        : ScrewMounting::kFixedPreload;
    const std::vector<double> grid = row.at("grid"), rise = row.at("temperature_rise");
    const auto u = screw_displacement(m, row.at("alpha"), row.at("preload_stretch"), grid, rise);
    for (std::size_t i = 0; i < row.at("x").size(); ++i)
      EXPECT_NEAR(interpolate(grid, u, row.at("x")[i]), row.at("displacement")[i].get<double>(), 1e-9);
  }
}

TEST(Screw, HeatIsKept) {
  // Without cooling the heat put in is the heat that is there; with it a uniform rise decays exponentially.
  ScrewHeat heat;
  heat.cooling_W_m2K = 0;
  heat.bearing_friction_N = 0;
  ScrewHeatModel model(600, heat, 61);
  std::vector<double> way(61, 0.0);
  way[20] = 1000;
  for (int i = 0; i < 100; ++i) model.step(1, way);
  const double area = M_PI * 0.02 * 0.02;
  double joule = 0;
  for (std::size_t i = 0; i < 61; ++i)
    joule += model.rise_K()[i] * 7850 * 460 * area * 0.01 * (i == 0 || i == 60 ? 0.5 : 1);
  EXPECT_NEAR(joule, 100 * heat.nut_friction_N * 1.0, 1e-6 * joule);
}

ScrewCorrectionConfig one_screw(double period_s) {
  ScrewCorrectionConfig config;
  config.period_s = period_s;
  config.screws.push_back({0, -450, 450, ScrewMounting::kFixedFree, 0, 11.7e-6, {}, {}});
  return config;
}

/// A nut that oscillates, now here, now there, for an hour; both the correction and the truth see it.
struct WarmUp {
  double before_um = 0, left_um = 0, step_um = 0;  ///< worst error without, with correction; worst step of it
};

template <typename Sensor>
WarmUp warm_up(ScrewCorrection& correction, TrueScrew& truth, double period_s, double seconds,
               Sensor&& sensor) {
  WarmUp out;
  JointVec q(1), offset(1);
  Feedback feedback;
  double last = 0, last_offset = 0;
  for (long i = 1; static_cast<double>(i) * period_s < seconds; ++i) {
    const double t = static_cast<double>(i) * period_s;
    const double centre = 25 + 125 * std::sin(t / 140);
    q[0] = centre + 150 * std::sin(1.6 * t);
    offset.setZero();
    correction.wanted({q, feedback}, offset);
    truth.move(q[0] + 450, std::abs(q[0] - last));
    last = q[0];
    if (i % 50 == 0) correction.work();
    out.step_um = std::max(out.step_um, 1000 * std::abs(offset[0] - last_offset));
    last_offset = offset[0];
    if (i % std::lround(1 / period_s) != 0) continue;
    truth.step(1);
    sensor(t);
    // The motor is told q + offset; the nut stands where the grown screw puts it.
    const double x = q[0] + offset[0] + 450;
    out.before_um = std::max(out.before_um, 1000 * truth.displacement(q[0] + 450));
    out.left_um = std::max(out.left_um, 1000 * std::abs(x + truth.displacement(x) - (q[0] + 450)));
  }
  return out;
}

TEST(Screw, AnHourOfWarmUpModelOnly) {
  SensorBoard board;
  ScrewCorrection correction(one_screw(0.01), board);
  TrueScrew truth(900, 120 * 1.05, 25 * 1.05, 12);  // the model's friction is 5 % too small
  const WarmUp result = warm_up(correction, truth, 0.01, 3600, [](double) {});
  std::printf("model only: %.2f um without, %.2f um with correction (%.1f %%)\n", result.before_um,
              result.left_um, 100 * result.left_um / result.before_um);
  EXPECT_GT(result.before_um, 20);
  EXPECT_LT(result.left_um, 0.1 * result.before_um);
}

TEST(Screw, AnHourOfWarmUpWithASensor) {
  SensorBoard board;
  ScrewCorrectionConfig config = one_screw(0.01);
  config.screws[0].sensor.channel = board.channel("x screw");
  config.screws[0].sensor.name = "x screw";
  config.screws[0].sensor.at_mm = 450;
  ScrewCorrection correction(config, board);
  TrueScrew truth(900, 120 * 1.3, 25 * 1.3, 12 * 1.1);  // a model that is far off
  const WarmUp result = warm_up(correction, truth, 0.01, 3600, [&](double) {
    board.publish(0, 20 + truth.rise_at(450));
    board.listen();
  });
  std::printf("sensor: %.2f um without, %.2f um with correction (%.1f %%)\n", result.before_um,
              result.left_um, 100 * result.left_um / result.before_um);
  EXPECT_GT(result.before_um, 20);
  EXPECT_LT(result.left_um, 0.1 * result.before_um);
}

TEST(Screw, ASensorThatFailsIsNamedAndNothingJumps) {
  for (const bool hold : {false, true}) {
    SensorBoard board;
    ScrewCorrectionConfig config = one_screw(0.01);
    config.screws[0].sensor.channel = board.channel("x screw");
    config.screws[0].sensor.name = "x screw";
    config.screws[0].sensor.at_mm = 450;
    config.screws[0].sensor.hold_on_dropout = hold;
    ScrewCorrection correction(config, board);
    TrueScrew truth(900, 120 * 1.3, 25 * 1.3, 12);
    std::string silent, absurd, good = "?";
    const WarmUp result = warm_up(correction, truth, 0.01, 1500, [&](double t) {
      if (t < 600 || t > 900) board.publish(0, t > 1000 && t < 1005 ? 900.0 : 20 + truth.rise_at(450));
      board.listen();
      if (t > 890 && t < 891.5) silent = correction.warning();
      if (t > 1003 && t < 1004.5) absurd = correction.warning();
      if (t > 1400) good = correction.warning();
    });
    EXPECT_NE(silent.find("x screw is silent"), std::string::npos) << silent;
    EXPECT_NE(absurd.find("x screw reads nonsense"), std::string::npos) << absurd;
    EXPECT_EQ(good, "");
    // In 10 ms the axis moves by 2.4 mm, the growth by 5e-4 of it, a profile by no more than 5 um/s.
    EXPECT_LT(result.step_um, 1.3);
  }
}

// The first word of a sensor is believed as it is, also of a screw that is warm already; nothing was there to
// jump from.
TEST(Screw, TheFirstReadingCountsAtOnce) {
  SensorBoard board;
  ScrewCorrectionConfig config = one_screw(0.01);
  config.screws[0].sensor.channel = board.channel("x screw");
  config.screws[0].sensor.name = "x screw";
  config.screws[0].sensor.at_mm = 450;
  ScrewCorrection correction(config, board);
  JointVec q = JointVec::Zero(1), offset(1);
  Feedback feedback;
  const auto run = [&](double seconds) {
    for (int i = 0; i < std::lround(seconds / 0.01); ++i) {
      board.listen();
      correction.wanted({q, feedback}, offset);
      correction.work();
    }
  };
  run(1);  // it has said nothing
  EXPECT_STREQ(correction.warning(), "");
  board.publish(0, 40);  // 20 K above the reference; 2 K/s is the most that a screw may change by
  run(0.3);
  EXPECT_STREQ(correction.warning(), "");
  EXPECT_NEAR(correction.rise_K(0)[30], 20, 0.01);
  board.publish(0, 45);
  run(0.3);
  EXPECT_NE(std::string(correction.warning()).find("reads nonsense"), std::string::npos) << "now it jumps";
}

TEST(Screw, LinearEncodersNeedNoCorrection) {
  SensorBoard board;
  const Machine machine = load_machine("head").machine;
  const ConfigTable section = parse_config(
      "[[axis]]\njoint = \"X\"\nencoder = \"linear\"\nmounting = \"fixed-fixed\"\nfixed_bearing_mm = -3000\n"
      "far_bearing_mm = 3000\n[[axis]]\njoint = \"Y\"\nmounting = \"fixed-free\"\nfixed_bearing_mm = -3000\n"
      "far_bearing_mm = 3000\n",
      "t");
  const ScrewCorrectionConfig config = read_screws(machine, section, board);
  ASSERT_EQ(config.screws.size(), 1u);
  EXPECT_EQ(config.screws[0].joint, 1);
}

}  // namespace
}  // namespace trn
