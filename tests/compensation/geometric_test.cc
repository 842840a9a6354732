#include "compensation/geometric.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "compensation/spline.h"
#include "core/units.h"
#include "tests/compensation/true_machine.h"
#include "tests/kinematics/machines.h"

// Geometric errors against the worked numbers and against matrix products (true_machine.h).
namespace trn {
namespace {

using test::angle_between;
using test::cradle;
using test::head;
using test::Mat4;
using test::Pige;
using test::TipAxis;

Pige pige_of(const nlohmann::json& j) {
  return {j.at("ey0a"), j.at("ez0a"), j.at("ty0a"), j.at("tz0a"),
          j.at("ex0c"), j.at("ey0c"), j.at("tx0c"), j.at("ty0c")};
}

void set_pige(ActualChain& chain, const Pige& e) {
  ActualAxis &A = *find_axis(chain, 3), &C = *find_axis(chain, 4);
  A.location = {{0, e.ey0a, e.ez0a}, {0, e.ty0a, e.tz0a}};
  C.location = {{e.ex0c, e.ey0c, 0}, {e.tx0c, e.ty0c, 0}};
}

Pose nominal_pose(const Kinematics& kinematics, const JointVec& q) {
  Pose X;
  EXPECT_EQ(kinematics.forward(q, X), KinStatus::kOk);
  return X;
}

Pige random_pige(std::mt19937& rng) {
  std::uniform_real_distribution<double> mm(-0.06, 0.06), rad(-2e-4, 2e-4);
  return {mm(rng), mm(rng), rad(rng), rad(rng), mm(rng), mm(rng), rad(rng), rad(rng)};
}

TEST(Geometric, VectorsOfTheCradle) {
  const LoadedMachine cradle_machine = load_machine("cradle");
  for (const auto& row : vector_rows("cradle_pige")) {
    GeometricConfig config;
    config.chain = read_chain(cradle_machine.machine);
    set_pige(config.chain, pige_of(row.at("pige")));
    const GeometricCorrection correction(config);
    const JointVec q = joints_of(row.at("joints"));
    const Vec3 tool(0, 0, row.at("tool_length").get<double>());
    Pose X;
    ASSERT_EQ(correction.actual(q, X), KinStatus::kOk);
    EXPECT_LT((X.p - X.R * tool - vec3_of(row.at("tip_actual"))).norm(), 1e-9);
    EXPECT_LT((X.R.col(2) - vec3_of(row.at("axis_actual"))).norm(), 1e-12);
    JointVec compensated = q;
    ASSERT_EQ(correction.correct(nominal_pose(*cradle_machine.kinematics, q), tool, compensated),
              KinStatus::kOk);
    EXPECT_LT((compensated - joints_of(row.at("joints_compensated"))).lpNorm<Eigen::Infinity>(), 1e-7);
  }
}

TEST(Geometric, FullModeReachesThePoseOnTheCradle) {
  const LoadedMachine machine = load_machine("cradle");
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> mm(-200, 200), a(0.2, 1.9), c(-3.1, 3.1);
  for (int i = 0; i < 2000; ++i) {
    const Pige e = random_pige(rng);
    GeometricConfig config;
    config.chain = read_chain(machine.machine);
    set_pige(config.chain, e);
    const GeometricCorrection correction(config);
    JointVec q(5);
    q << mm(rng), mm(rng), mm(rng), (i % 2 ? 1 : -1) * a(rng), c(rng);
    const double tool = 100;
    JointVec corrected = q;
    ASSERT_EQ(correction.correct(nominal_pose(*machine.kinematics, q), {0, 0, tool}, corrected),
              KinStatus::kOk);
    const TipAxis wanted = cradle({}, q, tool), got = cradle(e, corrected, tool);
    EXPECT_LT((got.tip - wanted.tip).norm(), 1e-6);
    EXPECT_LT(angle_between(got.axis, wanted.axis), 1e-9);
  }
}

TEST(Geometric, FullModeReachesThePoseOnAHead) {
  const LoadedMachine machine = load_machine("head");
  std::mt19937 rng(8);
  std::uniform_real_distribution<double> mm(-200, 200), error(-0.05, 0.05), tilt(-2e-4, 2e-4), a(0.2, 1.4),
      c(-3, 3);
  for (int i = 0; i < 1000; ++i) {
    GeometricConfig config;
    config.chain = read_chain(machine.machine);
    double e[2][6];
    for (auto& axis : e)
      for (int k = 0; k < 6; ++k) axis[k] = k < 3 ? error(rng) : tilt(rng);
    for (const int k : {0, 1}) {
      const double* v = e[k];
      find_axis(config.chain, k == 0 ? 4 : 3)->location = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
    }
    const Mat4 E_C = test::error_matrix(e[0][0], e[0][1], e[0][2], e[0][3], e[0][4], e[0][5]);
    const Mat4 E_A = test::error_matrix(e[1][0], e[1][1], e[1][2], e[1][3], e[1][4], e[1][5]);
    const GeometricCorrection correction(config);
    JointVec q(5);
    q << mm(rng), mm(rng), mm(rng), (i % 2 ? 1 : -1) * a(rng), c(rng);
    JointVec corrected = q;
    ASSERT_EQ(correction.correct(nominal_pose(*machine.kinematics, q), {0, 0, 120}, corrected),
              KinStatus::kOk);
    const TipAxis wanted = head(Mat4::Identity(), Mat4::Identity(), q, 120),
                  got = head(E_C, E_A, corrected, 120);
    EXPECT_LT((got.tip - wanted.tip).norm(), 1e-6);
    EXPECT_LT(angle_between(got.axis, wanted.axis), 1e-9);
  }
}

TEST(Geometric, PositionModeKeepsTheRotaryJoints) {
  const LoadedMachine machine = load_machine("cradle");
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> mm(-200, 200), a(-2, 2), c(-3.1, 3.1);
  for (int i = 0; i < 1000; ++i) {
    const Pige e = random_pige(rng);
    GeometricConfig config;
    config.chain = read_chain(machine.machine);
    config.mode = GeometricMode::kPosition;
    set_pige(config.chain, e);
    const GeometricCorrection correction(config);
    JointVec q(5);
    q << mm(rng), mm(rng), mm(rng), i % 10 == 0 ? 0 : a(rng), c(rng);
    JointVec corrected = q;
    ASSERT_EQ(correction.correct(nominal_pose(*machine.kinematics, q), {0, 0, 80}, corrected),
              KinStatus::kOk);
    EXPECT_EQ(corrected[3], q[3]);
    EXPECT_EQ(corrected[4], q[4]);
    EXPECT_LT((cradle(e, corrected, 80).tip - cradle({}, q, 80).tip).norm(), 1e-9);
  }
}

TEST(Geometric, FullModeStaysBoundedAtThePole) {
  const LoadedMachine machine = load_machine("cradle");
  std::mt19937 rng(10);
  std::uniform_real_distribution<double> mm(-100, 100), decade(-9, 0), c(-3.1, 3.1);
  double worst_turn = 0;
  for (int i = 0; i < 3000; ++i) {
    const Pige e = random_pige(rng);
    GeometricConfig config;
    config.chain = read_chain(machine.machine);
    set_pige(config.chain, e);
    const GeometricCorrection correction(config);
    JointVec q(5);
    q << mm(rng), mm(rng), mm(rng), i % 5 == 0 ? 0 : std::pow(10, decade(rng)), c(rng);
    JointVec corrected = q;
    const Pose X = nominal_pose(*machine.kinematics, q);
    ASSERT_EQ(correction.correct(X, {0, 0, 100}, corrected), KinStatus::kOk);
    worst_turn = std::max(worst_turn, std::abs(corrected[4] - q[4]));
    // The tip is right everywhere; the axis error left is told, never larger than without correction.
    const TipAxis wanted = cradle({}, q, 100), got = cradle(e, corrected, 100), before = cradle(e, q, 100);
    EXPECT_LT((got.tip - wanted.tip).norm(), 1e-6);
    const double left = angle_between(got.axis, wanted.axis);
    EXPECT_LE(left, angle_between(before.axis, wanted.axis) * (1 + 1e-3) + 1e-9);
    EXPECT_NEAR(correction.residual(X, {0, 0, 100}, corrected).axis_rad, left, 1e-12);
    // The zone ends at s0 = 2 lambda0, with lambda0 the sum of the tilts over the limit of a turn.
    const double lambda0 =
        std::max((std::hypot(e.ty0a, e.tz0a) + std::hypot(e.tx0c, e.ty0c)) / config.limit_rad, 1e-4);
    if (q[3] > std::asin(std::min(1.0, 2 * lambda0)) * 1.01) {
      EXPECT_LT(left, 1e-9);
    }
  }
  EXPECT_LT(worst_turn, GeometricConfig{}.limit_rad);
  EXPECT_GT(worst_turn, 0.1 * GeometricConfig{}.limit_rad);
}

TEST(Geometric, TheCorrectionIsSmoothThroughThePoleZone) {
  const LoadedMachine machine = load_machine("cradle");
  GeometricConfig config;
  config.chain = read_chain(machine.machine);
  set_pige(config.chain, {0.03, -0.03, 1e-4, -5e-5, 0.01, 0.02, 7e-5, 1e-4});
  const GeometricCorrection correction(config);
  // Fourth differences of the corrected C over a sweep of A shrink with the step: no kink in three
  // derivatives.
  const auto roughness = [&](double h) {
    double worst = 0, window[5] = {};
    for (int i = 0; i * h < 0.3; ++i) {
      JointVec q(5);
      q << 10, 20, 30, -0.15 + i * h, 0.7;
      JointVec corrected = q;
      EXPECT_EQ(correction.correct(nominal_pose(*machine.kinematics, q), {0, 0, 100}, corrected),
                KinStatus::kOk);
      for (int k = 0; k < 4; ++k) window[k] = window[k + 1];
      window[4] = corrected[4] - q[4];
      if (i >= 4)
        worst =
            std::max(worst, std::abs(window[0] - 4 * window[1] + 6 * window[2] - 4 * window[3] + window[4]));
    }
    return worst;
  };
  const double coarse = roughness(1e-3), fine = roughness(5e-4);
  EXPECT_LT(fine, coarse / 7);  // between h^3 (a jump of the third derivative) and h^4
}

TEST(Geometric, SquarenessTurnsTheDirectionOfMotion) {
  const LoadedMachine machine = load_machine("mill");
  GeometricConfig config;
  config.chain = read_chain(machine.machine);
  find_axis(config.chain, 1)->location.tilt = {0, 0, 1e-4};  // C0Y: Y leans towards -X
  const GeometricCorrection correction(config);
  JointVec q(3);
  q << 10, 100, 20;
  const Pose X = nominal_pose(*machine.kinematics, q);
  ASSERT_EQ(correction.correct(X, Vec3::Zero(), q), KinStatus::kOk);
  EXPECT_NEAR(q[0], 10 - 100 * 1e-4, 1e-9);  // it is the table that went astray
  EXPECT_NEAR(q[1], 100, 1e-9);
}

TEST(Geometric, TablesOfALinearAxisActAtTheMovingPoint) {
  const LoadedMachine machine = load_machine("mill");
  GeometricConfig config;
  config.chain = read_chain(machine.machine);
  ErrorTables tables;  // EYX = 2e-4 x, EBX = 1e-6 x
  tables.offset[1] = Spline({0, 100}, {0, 0.02});
  tables.tilt[1] = Spline({0, 100}, {0, 1e-4});
  find_axis(config.chain, 0)->tables.push_back(tables);
  const GeometricCorrection correction(config);
  JointVec q(3);
  q << 50, 0, 0;
  Pose X;
  ASSERT_EQ(correction.actual(q, X), KinStatus::kOk);
  // Tool of 100 mm: the tip swings by 100 * 5e-5 along -X.
  const Vec3 tip = X.p - X.R * Vec3(0, 0, 100),
             nominal = nominal_pose(*machine.kinematics, q).p - Vec3(0, 0, 100);
  EXPECT_NEAR(tip.y() - nominal.y(), 0.01, 1e-9);
  EXPECT_NEAR(tip.x() - nominal.x(), -0.005, 1e-9);
  const Pose wanted = nominal_pose(*machine.kinematics, q);
  ASSERT_EQ(correction.correct(wanted, {0, 0, 100}, q), KinStatus::kOk);
  EXPECT_LT(correction.residual(wanted, {0, 0, 100}, q).tip_mm, 1e-9);
}

/// Six errors of an axis that rise with its position (mm, rad): e(q) = at zero + slope q.
struct LinearErrors {
  double zero[6], slope[6];
  Mat4 at(double q) const {
    double e[6];
    for (int k = 0; k < 6; ++k) e[k] = zero[k] + slope[k] * q;
    return test::error_matrix(e[0], e[1], e[2], e[3], e[4], e[5]);
  }
};

std::string six_tables(const char* joint, bool rotary, const LinearErrors& e) {
  static constexpr const char* kKeys[] = {"ex_mm", "ey_mm", "ez_mm", "ea_arcsec", "eb_arcsec", "ec_arcsec"};
  std::string out = fmt::format("[[corrections.geometric.axis]]\njoint = \"{}\"\n", joint);
  out += "[corrections.geometric.axis.table]\n";
  out += rotary ? "at_deg = [-200.0, 30.0, 200.0]\n" : "at_mm = [-400.0, 50.0, 500.0]\n";
  for (int k = 0; k < 6; ++k) {
    const double unit = k < 3 ? 1 : kDegPerRad * 3600;
    const auto value = [&](double at) {
      return unit * (e.zero[k] + e.slope[k] * (rotary ? at * kRadPerDeg : at));
    };
    out +=
        rotary
            ? fmt::format("{} = [{:.17g}, {:.17g}, {:.17g}]\n", kKeys[k], value(-200), value(30), value(200))
            : fmt::format("{} = [{:.17g}, {:.17g}, {:.17g}]\n", kKeys[k], value(-400), value(50), value(500));
  }
  return out;
}

// The full set of ISO 230-1: six position-dependent errors of every axis, from the config.
TEST(Geometric, SixTablesOfEveryAxisAreCorrected) {
  std::mt19937 rng(11);
  std::uniform_real_distribution<double> one(-1, 1), mm(-200, 200), a(0.3, 1.5);
  LinearErrors e[5];
  std::string text = "[corrections.geometric]\nmode = \"full\"\n";
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 6; ++k) {
      e[i].zero[k] = (k < 3 ? 0.02 : 1e-4) * one(rng);
      e[i].slope[k] = (k < 3 ? 0.02 : 1e-4) * one(rng) / (i < 3 ? 300 : 2);
    }
    const std::string name(1, "XYZAC"[i]);
    text += six_tables(name.c_str(), i > 2, e[i]);
  }
  const LoadedMachine machine = load_machine("cradle");
  const ConfigTable root = parse_config(text, "t");
  const GeometricCorrection correction(
      read_geometric(machine.machine, root.table("corrections").table("geometric")));
  const auto truth = [&](const JointVec& q, double tool) {
    const Mat4 X_MS = test::shift(q[0], 0, 0) * e[0].at(q[0]) * test::shift(0, q[1], 0) * e[1].at(q[1]) *
                      test::shift(0, 0, q[2]) * e[2].at(q[2]);
    const Mat4 X_MB =
        e[3].at(q[3]) * test::turn(0, q[3]) * test::shift(0, 0, -75) * e[4].at(q[4]) * test::turn(2, q[4]);
    const Mat4 X_BS = X_MB.inverse() * X_MS;
    return TipAxis{(X_BS * Eigen::Vector4d(0, 0, -tool, 1)).head<3>(),
                   (X_BS * Eigen::Vector4d(0, 0, 1, 0)).head<3>()};
  };
  for (int i = 0; i < 500; ++i) {
    JointVec q(5);
    q << mm(rng), mm(rng), mm(rng), (i % 2 ? 1 : -1) * a(rng), 3 * one(rng);
    JointVec corrected = q;
    ASSERT_EQ(correction.correct(nominal_pose(*machine.kinematics, q), {0, 0, 100}, corrected),
              KinStatus::kOk);
    const TipAxis wanted = cradle({}, q, 100), got = truth(corrected, 100), before = truth(q, 100);
    EXPECT_GT((before.tip - wanted.tip).norm(), 1e-4);
    EXPECT_LT((got.tip - wanted.tip).norm(), 1e-6);
    EXPECT_LT(angle_between(got.axis, wanted.axis), 1e-9);
  }
}

// A full turn of C: the table goes on behind its end as it began, smoothly.
TEST(Geometric, APeriodicTableGoesOnTurnAfterTurn) {
  std::vector<double> at, value;
  for (int i = 0; i <= 24; ++i) {
    at.push_back(2 * kPi * i / 24 - 1);
    value.push_back(0.01 * std::sin(at.back()) + 0.003 * std::cos(2 * at.back()));
  }
  value.back() = value.front();
  const Spline table = Spline::periodic(at, value);
  for (double x = -20; x < 20; x += 0.037) {
    EXPECT_NEAR(table.at(x), 0.01 * std::sin(x) + 0.003 * std::cos(2 * x), 3e-6);
    EXPECT_NEAR(table.slope(x), 0.01 * std::cos(x) - 0.006 * std::sin(2 * x), 3e-5);
  }
  EXPECT_THROW(Spline::periodic({0, 1, 2, 3}, {0, 1, 2, 1}), std::invalid_argument);
}

constexpr char kConfig[] = R"(
[machine]
name = "t"
period_s = 0.001
[[joint]]
name = "X"
type = "linear"
min_mm = -1
max_mm = 1
velocity_mm_s = 1
acceleration_mm_s2 = 1
jerk_mm_s3 = 1
)";

TEST(Geometric, OnlySerialMachinesHaveAxes) {
  const Machine machine =
      read_machine(parse_config(std::string(kConfig) + "[kinematics]\ntype = \"hexapod\"\n", "t"));
  try {
    read_chain(machine);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("t:14:"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn
