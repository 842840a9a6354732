#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "compensation/fit/ballbar_fit.h"
#include "core/units.h"
#include "tests/kinematics/machines.h"
#include "tests/support/rounds.h"

// Ball-bar readings against worked numbers; identification against known errors and the Cramer-Rao bound.
namespace trn {
namespace {

constexpr double kArcsec = kRadPerDeg / 3600;

/// Errors in the order ey0a ez0a ty0a tz0a ex0c ey0c tx0c ty0c.
using Eight = std::array<double, 8>;
constexpr const char* kNames[] = {"ey0a", "ez0a", "ty0a", "tz0a", "ex0c", "ey0c", "tx0c", "ty0c"};
constexpr double kT = 0.01 * kRadPerDeg;
constexpr Eight kTable1 = {0.01, 0.01, kT, kT, 0.01, 0.01, kT, kT};
constexpr Eight kMeasured = {0.0335, -0.0356, 7.23 * kArcsec,   2.94 * kArcsec,
                             0.0014, -0.0513, -26.03 * kArcsec, -14.38 * kArcsec};

ActualChain cradle_chain(const Eight& e = {}) {
  ActualChain chain = read_chain(load_machine("cradle").machine);
  find_axis(chain, 3)->location = {{0, e[0], e[1]}, {0, e[2], e[3]}};
  find_axis(chain, 4)->location = {{e[4], e[5], 0}, {e[6], e[7], 0}};
  return chain;
}

std::vector<BallbarTrace> measure(const Eight& errors, const std::vector<std::string>& names,
                                  double noise_mm = 0, unsigned seed = 1, double sign = 1,
                                  const BallbarSetup& setup = {}) {
  const ActualChain truth = cradle_chain(errors);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<BallbarTrace> traces;
  for (const BallbarTest& test : ballbar_tests(truth)) {
    if (std::find(names.begin(), names.end(), test.name) == names.end()) continue;
    BallbarTrace trace{test, {}};
    for (double angle = test.from_rad; angle < test.to_rad + 1e-9; angle += test.step_rad)
      trace.readings.push_back(
          {angle, ballbar_reading(truth, test, setup, ballbar_joints(truth, test, angle)) +
                      (noise_mm > 0 ? sign * noise_mm * normal(random) : 0)});
    traces.push_back(trace);
  }
  return traces;
}

const std::vector<std::string> kFour = {"a", "a_extended", "c", "c_extended"};
const std::vector<std::string> kCircles = {"a_left", "a_right", "c_low", "c_high"};

TEST(Ballbar, TracesOfThePublishedCase) {
  const auto vectors = load_vectors("ballbar_table1");
  const auto tests = ballbar_tests(cradle_chain());
  ASSERT_EQ(vectors.at("tests").size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& row = vectors.at("tests")[i];
    EXPECT_LT((tests[i].ball_B - vec3_of(row.at("ball_in_table"))).norm(), 1e-12);
    EXPECT_LT((tests[i].cup_M - vec3_of(row.at("cup_in_reference"))).norm(), 1e-12);
    EXPECT_EQ(tests[i].bar_mm, row.at("bar").get<double>());
    for (int which = -1; which < 8; ++which) {
      Eight errors{};
      if (which < 0) errors = kTable1;
      if (which >= 0) errors[static_cast<std::size_t>(which)] = kTable1[static_cast<std::size_t>(which)];
      const ActualChain chain = cradle_chain(errors);
      const auto& expected = which < 0 ? row.at("all_errors") : row.at("single_error").at(kNames[which]);
      for (std::size_t k = 0; k < expected.size(); ++k) {
        const JointVec q = ballbar_joints(chain, tests[i], row.at("angle")[k].get<double>());
        EXPECT_NEAR(ballbar_reading(chain, tests[i], {}, q), expected[k].get<double>(), 1e-9);
      }
    }
  }
}

TEST(Ballbar, ReadingsAreAsManyAsThePaperSays) {
  std::vector<std::size_t> counts;
  for (const BallbarTrace& trace : measure({}, kFour)) counts.push_back(trace.readings.size());
  EXPECT_EQ(counts, (std::vector<std::size_t>{441, 441, 721, 721}));
}

void expect_errors(const BallbarFit& fit, const Eight& expected, double mm, double rad) {
  for (std::size_t i = 0; i < 8; ++i) {
    const BallbarParameter& p = fit.parameters[i];
    EXPECT_NEAR(p.value, expected[i], p.kind == BallbarParameter::Kind::kTilt ? rad : mm) << p.name;
  }
}

TEST(Ballbar, AllErrorsComeBackWithoutNoise) {
  for (const Eight& errors : {kTable1, kMeasured})
    for (const bool setup : {false, true}) {
      const BallbarFit fit = fit_ballbar(cradle_chain(), measure(errors, kFour), {setup, std::nullopt});
      expect_errors(fit, errors, 1e-9, 1e-6 * kArcsec);
      EXPECT_LT(fit.rms_mm, 1e-9);
    }
}

TEST(Ballbar, TellsWhatTheReadingsCannotTell) {
  const BallbarFit fit = fit_ballbar(cradle_chain(), measure(kMeasured, kFour), {true, std::nullopt});
  int told = 0, untold = 0;
  for (std::size_t i = 8; i < fit.parameters.size(); ++i)
    ++(fit.parameters[i].unknown.empty() ? told : untold);
  EXPECT_GT(told, 0);
  EXPECT_GT(untold, 0);
  // The cup defines the machine's origin: moving it is moving both axes.
  for (const BallbarParameter& p : fit.parameters)
    if (p.name == "cup.y") {
      EXPECT_FALSE(p.unknown.empty());
    }
  EXPECT_THROW(fit_ballbar(cradle_chain(), measure(kMeasured, {"a", "a_extended"}), {}), std::runtime_error);
}

TEST(Ballbar, ANumberThatIsNoneIsNamed) {
  const auto why = [](std::size_t test, double angle_rad, double reading_mm, bool planar) {
    auto traces = measure(kMeasured, planar ? kCircles : kFour);
    traces[test].readings[4] = {angle_rad, reading_mm};
    try {
      if (planar)
        fit_planar(cradle_chain(), traces);
      else
        fit_ballbar(cradle_chain(), traces, {});
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const double nan = std::nan(""), inf = INFINITY;
  EXPECT_EQ(why(0, 0, nan, false), "a reading of test 'a' is not a finite number: number 5 of 441");
  EXPECT_EQ(why(2, 0, -inf, false), "a reading of test 'c' is not a finite number: number 5 of 721");
  EXPECT_EQ(why(1, nan, 0, false), "an angle of test 'a_extended' is not a finite number: number 5 of 441");
  EXPECT_EQ(why(0, 0, nan, true), "a reading of test 'a_left' is not a finite number: number 5 of 441");
}

TEST(Ballbar, ABallBesideItsPlaceDoesNoHarm) {
  BallbarSetup setup;
  setup.ball_offset_B = {0.02, 0.02, 0};
  const auto traces = measure(kMeasured, kFour, 0, 1, 1, setup);
  const BallbarFit blind = fit_ballbar(cradle_chain(), traces, {false, std::nullopt});
  const BallbarFit fit = fit_ballbar(cradle_chain(), traces, {true, std::nullopt});
  const auto worst = [](const BallbarFit& f) {
    double out = 0;
    for (std::size_t i = 0; i < 8; ++i)
      out = std::max(out, std::abs(f.parameters[i].value - kMeasured[i]) /
                              (f.parameters[i].kind == BallbarParameter::Kind::kTilt ? kArcsec : 1e-3));
    return out;
  };
  std::printf(
      "ball 20 um beside its place: worst error of the fit %.3f um or arcsec, %.4f with the set-up fitted\n",
      worst(blind), worst(fit));
  EXPECT_GT(worst(blind), 1.0);  // um or arcsec
  EXPECT_LT(worst(fit), 0.05);   // what is left is the part of the offset that the readings cannot tell
}

/// The chain and set-up of a test with one fitted unknown `step` off its value.
double reading_beside(const BallbarFit& fit, std::size_t unknown, double step, const BallbarTest& test,
                      double angle) {
  ActualChain chain = cradle_chain(kMeasured);
  BallbarSetup setup;
  const BallbarParameter& p = fit.parameters[static_cast<std::size_t>(fit.fitted[unknown])];
  SixErrors& location = find_axis(chain, p.joint)->location;
  if (p.kind == BallbarParameter::Kind::kOffset) location.offset[p.component] += step;
  if (p.kind == BallbarParameter::Kind::kTilt) location.tilt[p.component] += step;
  if (p.kind == BallbarParameter::Kind::kBall && p.joint == test.joint)
    setup.ball_offset_B[p.component] = step;
  if (p.kind == BallbarParameter::Kind::kCup) setup.cup_offset_M[p.component] = step;
  return ballbar_reading(chain, test, setup, ballbar_joints(chain, test, angle));
}

/// Cramer-Rao bound of each fitted unknown (mm, rad): no unbiased estimator has less scatter than the root of
/// the diagonal of (J^T J)^-1 times the noise of a reading, with J the readings' derivatives by the unknowns.
std::vector<double> cramer_rao_bounds(const BallbarFit& fit, double noise_mm) {
  const auto traces = measure(kMeasured, kFour);
  std::size_t rows = 0;
  for (const BallbarTrace& trace : traces) rows += trace.readings.size();
  Eigen::MatrixXd J(rows, fit.fitted.size());
  std::vector<double> scale;  // about as much as moves a reading by 1 mm
  for (std::size_t k = 0; k < fit.fitted.size(); ++k) {
    const BallbarParameter& p = fit.parameters[static_cast<std::size_t>(fit.fitted[k])];
    scale.push_back(p.kind == BallbarParameter::Kind::kTilt ? 0.01 : 1.0);
    const double step = 1e-4 * scale.back();
    Eigen::Index row = 0;
    for (const BallbarTrace& trace : traces)
      for (const BallbarReading& r : trace.readings)
        J(row++, static_cast<Eigen::Index>(k)) = (reading_beside(fit, k, step, trace.test, r.angle_rad) -
                                                  reading_beside(fit, k, -step, trace.test, r.angle_rad)) /
                                                 2e-4;
  }
  const Eigen::VectorXd variance = (J.transpose() * J).inverse().diagonal();
  std::vector<double> out;
  for (std::size_t k = 0; k < scale.size(); ++k)
    out.push_back(noise_mm * std::sqrt(variance[static_cast<Eigen::Index>(k)]) * scale[k]);
  return out;
}

/// Scatter of the fitted errors over seeded repetitions with 1 um of noise, against the Cramer-Rao bound.
/// Runs come in pairs with opposite noise, so that the mean shows the bias without the scatter.
void judge_estimator(bool fit_setup, int pairs, double most) {
  constexpr double kNoise = 1e-3;
  std::vector<double> sum(8, 0.0), sum2(8, 0.0);
  BallbarFit fit;
  for (int i = 0; i < 2 * pairs; ++i) {
    const auto traces = measure(kMeasured, kFour, kNoise, static_cast<unsigned>(100 + i / 2), i % 2 ? -1 : 1);
    fit = fit_ballbar(cradle_chain(), traces, {fit_setup, kNoise});
    for (std::size_t k = 0; k < 8; ++k) {
      const double error = fit.parameters[k].value - kMeasured[k];
      sum[k] += error;
      sum2[k] += error * error;
    }
  }
  const auto bounds = cramer_rao_bounds(fit, kNoise);
  const double n = 2.0 * pairs;
  std::printf("%d repetitions, set-up %s\n", 2 * pairs, fit_setup ? "fitted too" : "taken as exact");
  for (std::size_t k = 0; k < 8; ++k) {
    const bool tilt = fit.parameters[k].kind == BallbarParameter::Kind::kTilt;
    const double bias = sum[k] / n, deviation = std::sqrt(sum2[k] / n - bias * bias);
    std::printf("  %-6s bound %.4f %s, deviation %.3f of it, bias %.4f of it\n",
                fit.parameters[k].name.c_str(), bounds[k] / (tilt ? kArcsec : 1e-3), tilt ? "arcsec" : "um",
                deviation / bounds[k], bias / bounds[k]);
    EXPECT_LT(std::abs(bias), 0.1 * bounds[k]);
    EXPECT_LT(deviation, most * bounds[k]);
    if (!fit_setup) {
      EXPECT_LT(bounds[k], tilt ? 0.36 * kArcsec : 0.13e-3);  // docs/sources.md S1.6: 0.12 um, 0.35 arcsec
    }
    EXPECT_NEAR(fit.parameters[k].deviation, bounds[k], 0.02 * bounds[k]);
  }
}

TEST(Ballbar, TheFitIsAsGoodAsTheReadingsAllow) {
  const bool many = test::long_form().has_value();
  const int pairs = many ? test::rounds(100) : 12;
  for (const bool fit_setup : {false, true}) judge_estimator(fit_setup, pairs, many ? 1.2 : 1.8);
}

TEST(Ballbar, ThePlanarMethodComesNear) {
  const auto traces = measure(kMeasured, kCircles);
  const BallbarFit fit = fit_planar(cradle_chain(), traces);
  expect_errors(fit, kMeasured, 1e-4, 0.3 * kArcsec);
}

// Every reading twice says the same, only more surely.
TEST(Ballbar, TheConditionIsOfTheTestsNotOfTheirNumber) {
  std::vector<BallbarTrace> twice = measure(kMeasured, kFour, 1e-4);
  const BallbarFit once = fit_ballbar(cradle_chain(), twice, {false, std::nullopt});
  const std::vector<BallbarTrace> again = twice;
  twice.insert(twice.end(), again.begin(), again.end());
  const BallbarFit fit = fit_ballbar(cradle_chain(), twice, {false, std::nullopt});
  EXPECT_GT(once.condition, 1);
  EXPECT_NEAR(fit.condition, once.condition, 1e-6 * once.condition);
}

}  // namespace
}  // namespace trn
