#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"
#include "kinematics/machines/hexapod.h"
#include "kinematics/machines/rail_mill.h"
#include "kinematics/newton.h"
#include "kinematics/segment_distance.h"
#include "tests/kinematics/machines.h"
#include "tests/kinematics/sampling.h"
#include "tests/support/rounds.h"

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
  for (int round = 0, n = test::rounds(5000); round < n && !HasFailure(); ++round) {
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

// RTCP off, as an operator sees it: X+ takes the tool X+ over the work, so the table goes X-; a longer tool
// lowers the table; and a tilt turns the table about its own origin, which carries the tip away as the
// displacement (R - I) w of docs/sources.md S3.5 says.
TEST(Hexapod, WordsWithoutRtcpAreTheToolsPlaceOverTheTable) {
  const LoadedMachine loaded = load_machine("hexapod");
  const auto& hexapod = as<Hexapod>(loaded);
  const auto table = [&](const Words& words) {
    JointVec q;
    Pose X_RP;
    EXPECT_EQ(hexapod.joints_from_words(words, q), KinStatus::kOk);
    EXPECT_EQ(hexapod.platform(q, X_RP), KinStatus::kOk);
    return X_RP;
  };
  Words words;
  words << 20, -30, 80, 0, 0, 0;
  EXPECT_LT((table(words).p - Vec3(-20, 30, 620)).norm(), 1e-9);  // the gauge point stands at (0, 0, 700)
  words.tail<3>() << 0.2, -0.1, 0;
  const Mat3 R_WT = rot_x(0.2) * rot_y(-0.1);
  EXPECT_LT((table(words).R - R_WT.transpose()).norm(), 1e-12);
  // the point of the work that the words name, seen from the tool: displaced by (R - I) w
  const Vec3 w = words.head<3>();
  EXPECT_LT((table(words) * w - Vec3(0, 0, 700) - (R_WT.transpose() * w - w)).norm(), 1e-9);
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
    // upright the words are the spindle's place, 25 mm above the platform's origin, about which it tilts
    EXPECT_LT((X_BS.p - words.head<3>() - 25 * (X_BS.R.col(2) - Vec3::UnitZ())).norm(), 1e-9);
    EXPECT_LT((kin.orientation(words.tail<3>()) - X_BS.R).norm(), 1e-12);
    JointVec back;
    ASSERT_EQ(kin.inverse(X_BS, q, back), KinStatus::kOk);
    EXPECT_LT((back - q).lpNorm<Eigen::Infinity>(), 1e-9);
  }
}

/// Variance of the squared legs: what the free turn makes least.
double leg_variance(const JointVec& q) {
  const Eigen::ArrayXd squares = q.array().square();
  return (squares - squares.mean()).square().mean();
}

// The free turn, judged by trying every turn on the plain machine: tip and axis stay, and no other turn
// balances the legs better but by what the bound of 20 deg holds back.
void judge_free_turn(const std::vector<std::pair<std::string, std::string>>& carrier) {
  const LoadedMachine plain = load_changed("hexapod", carrier);
  auto edits = carrier;
  edits.push_back({"free_turn_deg_max = 0.0", "free_turn_deg_max = 20.0"});
  const LoadedMachine free = load_changed("hexapod", edits);
  Sampler sampler(plain, 24);
  double before = 0, after = 0;
  int compared = 0;
  for (int round = 0; round < 500 && !testing::Test::HasFailure(); ++round) {
    const JointVec q = sampler.joints();
    Pose wanted, reached;
    ASSERT_EQ(plain.kinematics->forward(q, wanted), KinStatus::kOk);
    JointVec turned;
    if (free.kinematics->inverse(wanted, q, turned) != KinStatus::kOk) continue;
    ASSERT_EQ(free.kinematics->forward(turned, reached), KinStatus::kOk);
    EXPECT_LT((reached.p - wanted.p).norm(), 1e-9);
    EXPECT_LT((reached.R.col(2) - wanted.R.col(2)).norm(), 1e-12);
    double best = std::numeric_limits<double>::infinity(), best_turn = 0;
    constexpr double kStep = 0.002, kBound = 20 * kPi / 180;
    const Mat3 R = plain.kinematics->orientation(
        {std::atan2(-wanted.R(1, 2), wanted.R(2, 2)), std::asin(wanted.R(0, 2)), 0});
    const auto variance_at = [&](double turn) {
      JointVec tried;
      const KinStatus status = plain.kinematics->inverse({R * rot_z(turn), wanted.p}, q, tried);
      return status == KinStatus::kOk ? leg_variance(tried) : std::numeric_limits<double>::infinity();
    };
    for (int i = -150; i <= 150; ++i) {
      const double there = variance_at(i * kStep);
      if (there >= best) continue;
      best = there;
      best_turn = i * kStep;
    }
    before += leg_variance(q);
    after += leg_variance(turned);
    EXPECT_LE(leg_variance(turned), leg_variance(q) * (1 + 1e-12));
    if (std::abs(best_turn) < 0.05) {
      EXPECT_LT(leg_variance(turned), best * 1.01 + 1.0);
    }
    if (std::abs(best_turn) < 0.25) {  // the lowest point of the parabola through three turns, softly bounded
      const double left = variance_at(best_turn - kStep), right = variance_at(best_turn + kStep);
      const double lowest =
          best_turn + 0.5 * kStep * (left - right) / (left - 2 * variance_at(best_turn) + right);
      const Mat3 turn = R.transpose() * reached.R;
      if (std::isfinite(lowest)) {  // not beside a turn that is out of reach
        ++compared;
        EXPECT_NEAR(std::atan2(turn(1, 0), turn(0, 0)), kBound * std::tanh(lowest / kBound), 2e-5);
      }
    }
  }
  EXPECT_LT(after, 0.9 * before);
  EXPECT_GT(compared, 100);
}

TEST(Hexapod, TheFreeTurnBalancesTheLegs) {
  judge_free_turn({});
  judge_free_turn({{"carries = \"work\"", "carries = \"spindle\""},
                   {"spindle_mm = [0.0, 0.0, 700.0]", "spindle_mm = [0.0, 0.0, -80.0]"}});
}

TEST(Hexapod, TheFreeTurnIsASmoothFunctionOfThePose) {
  const LoadedMachine free =
      load_changed("hexapod", {{"free_turn_deg_max = 0.0", "free_turn_deg_max = 20.0"}});
  std::array<JointVec, 4> last;
  const double h = 1e-3;
  for (int i = 0; i <= 1000; ++i) {
    const double s = (i - 500) * h;
    Words words, again;
    words << 60 * s, 80 + 20 * s, 60 + 10 * s, 0.5 * s, 0.3 - 0.4 * s, 0;
    JointVec q;
    ASSERT_EQ(free.kinematics->joints_from_words(words, q), KinStatus::kOk);
    ASSERT_EQ(free.kinematics->words_from_joints(q, again), KinStatus::kOk);
    EXPECT_LT((again - words).lpNorm<Eigen::Infinity>(), 1e-9);
    std::rotate(last.begin(), last.begin() + 1, last.end());
    last[3] = q;
    if (i < 3) continue;
    const JointVec third = last[3] - 3 * last[2] + 3 * last[1] - last[0];
    EXPECT_LT(third.lpNorm<Eigen::Infinity>(), 200 * h * h * h + 1e-11);
  }
}

// The greatest of twelve angles, from the places of the joints as the config has them. By turns each leg has
// the worst.
TEST(Hexapod, TheWorstEndOfAnyLegIsItsJointAngle) {
  const LoadedMachine loaded = load_machine("hexapod");
  const auto& hexapod = as<Hexapod>(loaded);
  const auto legs = loaded.machine.root.table("kinematics").tables("leg");
  ASSERT_EQ(legs.size(), 6u);
  const auto angle = [](const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); };
  std::set<std::size_t> worst_legs;
  for (int k = 0; k < 72; ++k) {
    const double way = 2 * kPi * k / 72;
    const Mat3 R = rot_z(way) * rot_x(0.25) * rot_z(-way);
    const Pose X{R, Vec3(60 * std::cos(3 * way), 60 * std::sin(3 * way), 640)};
    double worst = 0;
    std::size_t worst_leg = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const Vec3 base = legs[i].vec3("base_mm"), joint = legs[i].vec3("platform_mm");
      const Vec3 home = joint + Vec3(0, 0, 640) - base, now = R * joint + X.p - base;
      const double here = std::max(angle(now, home), angle(R.transpose() * now, home));
      if (here > worst) worst = here, worst_leg = i;
    }
    worst_legs.insert(worst_leg);
    EXPECT_NEAR(hexapod.joint_angle(X), worst, 1e-7) << k;
  }
  EXPECT_EQ(worst_legs.size(), 6u);
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

TEST(RailMill, APlaceThatIsTooSoftIsSingular) {
  const Pose X = {rot_x(0.3), Vec3(60, -40, -330)};
  const double there = as<RailMill>(load_machine("rail_mill")).conditioning(X);
  ASSERT_GT(there, 0.03) << "legal on the machine as it ships";
  for (const bool softer : {false, true}) {
    const std::string least = fmt::format("conditioning_min = {:.6f}", there * (softer ? 1.001 : 0.999));
    const LoadedMachine loaded = load_changed("rail_mill", {{"conditioning_min = 0.03", least}});
    JointVec q;
    EXPECT_EQ(as<RailMill>(loaded).actuators(X, q), softer ? KinStatus::kSingular : KinStatus::kOk) << least;
  }
}

// From these sliders a straight Newton that begins at home ends in another assembly of the links.
TEST(RailMill, FarFromHomeThePlatformIsLedToItsOwnAssembly) {
  const LoadedMachine loaded = load_machine("rail_mill");
  const auto& mill = as<RailMill>(loaded);
  const Pose far[] = {{rot_x(-0.387355), {389.328, -173.639, -303.138}},
                      {rot_x(-0.853683), {388.894, -96.1544, -245.308}},
                      {rot_x(-0.628011), {-414.86, -72.8503, -355.214}},
                      {rot_x(0.79537), {376.817, 114.925, -248.347}}};
  for (const Pose& X : far) {
    JointVec q;
    ASSERT_EQ(mill.actuators(X, q), KinStatus::kOk);
    ASSERT_LT(q.lpNorm<Eigen::Infinity>(), 900) << "inside the sliders' limits";
    Pose found;
    ASSERT_EQ(mill.platform(q, found), KinStatus::kOk);
    EXPECT_LT((found.p - X.p).norm(), 1e-6);
    EXPECT_LT((found.R - X.R).norm(), 1e-9);
  }
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
