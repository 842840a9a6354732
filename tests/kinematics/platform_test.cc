#include <gtest/gtest.h>

#include "kinematics/machines/hexapod.h"
#include "kinematics/machines/rail_mill.h"
#include "kinematics/segment_distance.h"
#include "tests/kinematics/sampling.h"

namespace trn {
namespace {

LoadedMachine load_changed(const std::string& name,
                           const std::vector<std::pair<std::string, std::string>>& edits) {
  std::ifstream in(config_path(name));
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  for (const auto& [from, to] : edits) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  Machine machine = read_machine(parse_config(text, name));
  auto kinematics = make_kinematics(machine);
  return {std::move(machine), std::move(kinematics)};
}

template <typename Type>
const Type& as(const LoadedMachine& loaded) {
  return dynamic_cast<const Type&>(*loaded.kinematics);
}

TEST(Hexapod, LegSpeedsAreTheDerivativeOfTheLegs) {
  const LoadedMachine loaded = load_machine("hexapod");
  const auto& hexapod = as<Hexapod>(loaded);
  const Pose X{rot_x(0.2) * rot_y(-0.15), Vec3(20, -30, 650)};
  const Eigen::Matrix<double, 6, 6> J = hexapod.leg_jacobian(X);
  const double h = 1e-4;
  for (int i = 0; i < 6; ++i) {
    const auto moved = [&](double s) {
      Pose Y = X;
      if (i < 3) Y.p[i] += s;
      if (i >= 3) Y.R = (i == 3 ? rot_x(s) : i == 4 ? rot_y(s) : rot_z(s)) * X.R;
      JointVec q;
      EXPECT_EQ(hexapod.actuators(Y, q), KinStatus::kOk);
      return q;
    };
    const JointVec slope = (moved(h) - moved(-h)) / (2 * h);
    EXPECT_LT((slope - J.col(i)).lpNorm<Eigen::Infinity>(), 1e-5);
  }
}

// The region a start may lie in: 40 mm and 0.2 rad off in every component the error falls to rounding within
// 6 steps, which only quadratic convergence does.
TEST(Hexapod, NewtonConvergesQuadraticallyFromNearby) {
  const LoadedMachine loaded = load_machine("hexapod");
  const auto& hexapod = as<Hexapod>(loaded);
  Sampler sampler(loaded, 21);
  int worst = 0;
  for (int round = 0, n = rounds(5000); round < n && !HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    Pose truth;
    ASSERT_EQ(hexapod.platform(q, truth), KinStatus::kOk);
    const auto some = [&](double r) { return sampler.uniform(-r, r); };
    Pose start{truth.R * rot_x(some(0.2)) * rot_y(some(0.2)) * rot_z(some(0.2)),
               truth.p + Vec3(some(40), some(40), some(40))};
    const NewtonReport report = hexapod.platform_from(q, start);
    ASSERT_EQ(report.status, KinStatus::kOk);
    EXPECT_LT((start.p - truth.p).norm(), 1e-9);
    EXPECT_LT((start.R - truth.R).norm(), 1e-12);
    worst = std::max(worst, report.iterations);
  }
  EXPECT_LE(worst, 6);
}

TEST(Hexapod, MirrorImageCarriesTheSpindle) {
  const LoadedMachine loaded =
      load_changed("hexapod", {{"carries = \"work\"", "carries = \"spindle\""},
                               {"spindle_mm = [0.0, 0.0, 700.0]", "spindle_mm = [0.0, 0.0, 25.0]"}});
  const Kinematics& kin = *loaded.kinematics;
  Sampler sampler(loaded, 22);
  for (int round = 0; round < 2000 && !HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    Pose X_BS;
    ASSERT_EQ(kin.forward(q, X_BS), KinStatus::kOk);
    Words words;
    ASSERT_EQ(kin.words_from_joints(q, words), KinStatus::kOk);
    // the platform is what the words say, the spindle sits 25 mm up its axis, and tilts as the words do
    EXPECT_LT((X_BS.p - words.head<3>() - 25 * X_BS.R.col(2)).norm(), 1e-9);
    EXPECT_LT((kin.orientation(words.tail<3>()) - X_BS.R).norm(), 1e-12);
    JointVec back;
    ASSERT_EQ(kin.inverse(X_BS, q, back), KinStatus::kOk);
    EXPECT_LT((back - q).lpNorm<Eigen::Infinity>(), 1e-9);
  }
}

TEST(Hexapod, LimitsOfTheMechanismAreNamed) {
  const LoadedMachine loaded = load_machine("hexapod");
  const auto& hexapod = as<Hexapod>(loaded);
  JointVec q;
  const Pose home = translation({0, 0, 640});
  EXPECT_EQ(hexapod.actuators(home, q), KinStatus::kOk);
  EXPECT_NEAR(hexapod.joint_angle(home), 0, 1e-7);
  const Pose tilted{rot_x(0.9), home.p};
  EXPECT_GT(hexapod.joint_angle(tilted), rad_from_deg(45));
  EXPECT_EQ(hexapod.actuators(tilted, q), KinStatus::kLimit);
  const LoadedMachine thick =
      load_changed("hexapod", {{"leg_distance_mm_min = 60.0", "leg_distance_mm_min = 110.0"}});
  EXPECT_EQ(as<Hexapod>(thick).actuators(home, q), KinStatus::kLimit);
  // A quarter turn about Z makes the legs' screws dependent: no leg resists a further turn.
  const LoadedMachine bare =
      load_changed("hexapod", {{"joint_angle_deg_max = 45.0", ""}, {"leg_distance_mm_min = 60.0", ""}});
  const Pose quarter{rot_z(kPi / 2), home.p};
  EXPECT_LT(as<Hexapod>(bare).conditioning(quarter), 1e-6);
  EXPECT_EQ(as<Hexapod>(bare).actuators(quarter, q), KinStatus::kSingular);
}

TEST(SegmentDistance, IsTheLeastOfManyPairsOfPoints) {
  const LoadedMachine loaded = load_machine("hexapod");
  Sampler sampler(loaded, 23);
  for (int round = 0; round < 200; ++round) {
    const Vec3 a = 3 * sampler.direction(), b = 3 * sampler.direction();
    const Vec3 da = 4 * sampler.direction(), db = round % 5 ? Vec3(3 * sampler.direction()) : Vec3(0.7 * da);
    double least = 1e9;
    for (int i = 0; i <= 100; ++i)
      for (int j = 0; j <= 100; ++j) least = std::min(least, (a + i * 0.01 * da - b - j * 0.01 * db).norm());
    const double distance = segment_distance(a, da, b, db);
    EXPECT_LE(distance, least + 1e-12);
    EXPECT_GE(distance, least - 0.05);  // the grid's own coarseness
  }
}

TEST(RailMill, OutOfReachAndSingularAreErrors) {
  const LoadedMachine loaded = load_machine("rail_mill");
  const auto& mill = as<RailMill>(loaded);
  JointVec q;
  EXPECT_EQ(mill.actuators(translation({0, 0, -700}), q), KinStatus::kUnreachable);
  EXPECT_LT(mill.reach(translation({0, 0, -700})), 0);
  // links square to their rails: the sliders cannot hold the platform up
  double low = -300, high = -700;
  for (int i = 0; i < 60; ++i)
    (mill.reach(translation({0, 0, (low + high) / 2})) > 0 ? low : high) = (low + high) / 2;
  EXPECT_EQ(mill.actuators(translation({0, 0, low}), q), KinStatus::kSingular);
  EXPECT_EQ(mill.actuators({rot_y(0.01), Vec3(0, 0, -300)}, q), KinStatus::kUnreachable);
  Vec3 abc;
  EXPECT_EQ(mill.words_for_axis(Vec3(0.1, 0, 1), Vec3::Zero(), abc), KinStatus::kUnreachable);
}

TEST(RailMill, RailSpeedsAreTheDerivativeOfTheRails) {
  const LoadedMachine loaded = load_machine("rail_mill");
  const auto& mill = as<RailMill>(loaded);
  const auto rails = [&](const Eigen::Vector4d& x) {
    JointVec q;
    EXPECT_EQ(mill.actuators({rot_x(x[3]), x.head<3>()}, q), KinStatus::kOk);
    return q;
  };
  const Eigen::Vector4d x(30, -20, -310, 0.2);
  const RailMill::Square J = mill.rail_jacobian({rot_x(x[3]), x.head<3>()});
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector4d h = 1e-4 * Eigen::Vector4d::Unit(i);
    EXPECT_LT(((rails(x + h) - rails(x - h)) / 2e-4 - J.col(i)).lpNorm<Eigen::Infinity>(), 1e-5);
  }
}

TEST(RailMill, TheTableMayRideOnThePlatform) {
  const LoadedMachine loaded =
      load_changed("rail_mill", {{"carries = \"spindle\"", "carries = \"work\""},
                                 {"spindle_mm = [0.0, 0.0, 0.0]", "spindle_mm = [0.0, 0.0, 50.0]"}});
  const Kinematics& kin = *loaded.kinematics;
  const Pose X_BS{kin.orientation({0.1, 0, 0}), Vec3(5, 6, 350)};
  JointVec q;
  ASSERT_EQ(kin.inverse(X_BS, JointVec::Zero(4), q), KinStatus::kOk);
  const Pose X_RP = as<RailMill>(loaded).platform_from_spindle(X_BS);
  EXPECT_LT((X_RP.R - rot_x(-0.1)).norm(), 1e-12);            // the tool tilts by D, the table by -D
  EXPECT_LT((X_RP * X_BS.p - Vec3(0, 0, 50)).norm(), 1e-12);  // the point lies under the spindle
}

}  // namespace
}  // namespace trn
