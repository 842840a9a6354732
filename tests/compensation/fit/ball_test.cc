#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "compensation/actual_chain.h"
#include "compensation/fit/ball_fit.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/units.h"
#include "tests/kinematics/machines.h"
#include "tests/support/rounds.h"

// Contacts of a ball on machines with known errors: identification against the truth and the Cramér-Rao
// bound.
namespace trn {
namespace {

constexpr double kArcsec = kRadPerDeg / 3600;
constexpr double kReach = 15.5, kNoise = 0.001;
const Vec3 kStylus(0, 0, -97);
const int kA_joint = 3, kC_joint = 4;

using Pairs = std::vector<std::pair<double, double>>;  // A and C, degrees

/// The errors of configs/cradle_measured.toml, on the cradle and on a head.
ActualChain chain_of(const std::string& machine, double share) {
  ActualChain chain = read_chain(load_machine(machine).machine);
  find_axis(chain, kA_joint)->location = {share * Vec3(0, 0.0335, -0.0356),
                                          share * kArcsec * Vec3(0, 7.23, 2.94)};
  find_axis(chain, kC_joint)->location = {share * Vec3(0.0014, -0.0513, 0),
                                          share * kArcsec * Vec3(-26.03, -14.38, 0)};
  return chain;
}

/// Air between ball and stylus on `chain`, in this file's own words.
double gap_of(const ActualChain& chain, const JointVec& q, const Vec3& ball_B, const Vec3& stylus_S,
              double reach) {
  ActualChain::Frames f;
  chain.evaluate(q, f);
  const Vec3 ball = f.X_MB.A * ball_B + f.X_MB.p, stylus = f.X_MS.A * stylus_S + f.X_MS.p;
  return (ball - stylus).norm() - reach;
}

std::mt19937 any;  // where there is no noise

/// Touches on the top and four sides in each position: the linear joints bring the stylus to where the ball
/// of the machine without errors is touched, and on along the same line to where the true one is, less noise.
std::vector<BallContact> touch(const ActualChain& nominal, const ActualChain& truth, const Vec3& ball_B,
                               const Pairs& positions, double noise_mm, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<BallContact> contacts;
  const double c30 = std::cos(kPi / 6);
  for (const auto& [a_deg, c_deg] : positions)
    for (const Vec3& side :
         {Vec3(0, 0, 1), Vec3(c30, 0, 0.5), Vec3(0, c30, 0.5), Vec3(-c30, 0, 0.5), Vec3(0, -c30, 0.5)}) {
      JointVec q = JointVec::Zero(5);
      q[kA_joint] = a_deg * kRadPerDeg;
      q[kC_joint] = c_deg * kRadPerDeg;
      ActualChain::Frames f;
      nominal.evaluate(q, f);
      const Vec3 away = f.X_MS.A * side;
      const Vec3 at = f.X_MB.p + f.X_MB.A * ball_B - f.X_MS.p - f.X_MS.A * kStylus;
      q.head<3>() = at + kReach * away;
      const double closes_at = noise_mm * normal(random);
      for (int i = 0; i < 20; ++i)
        q.head<3>() -= (gap_of(truth, q, ball_B, kStylus, kReach) - closes_at) * away;
      EXPECT_NEAR(gap_of(truth, q, ball_B, kStylus, kReach), closes_at, 1e-11);
      contacts.push_back({q, kStylus});
    }
  return contacts;
}

const Pairs kTwelve = {{0, 0},   {0, 90},  {0, 180}, {-45, 180}, {-90, 180}, {-90, 90},
                       {-90, 0}, {-45, 0}, {0, -90}, {60, -90},  {60, 0},    {60, 90}};
const Vec3 kBall(0.4, 100.3, 49.8);

double true_value(const BallParameter& p, const ActualChain& truth, const Vec3& ball_B) {
  ActualChain chain = truth;
  if (p.kind == BallParameter::Kind::kBall) return ball_B[p.component];
  if (p.kind == BallParameter::Kind::kRadius) return kReach;
  if (p.kind == BallParameter::Kind::kStylus) return 0;
  const SixErrors& e = find_axis(chain, p.joint)->location;
  return (p.kind == BallParameter::Kind::kTilt ? e.tilt : e.offset)[p.component];
}

/// Standard errors at the Cramér-Rao bound of the fitted parameters, by differences of this file's own gap.
Eigen::VectorXd bound_of(const BallFit& fit, const ActualChain& truth, const Vec3& ball_B,
                         const std::vector<BallContact>& contacts, double noise_mm) {
  Eigen::MatrixXd J(static_cast<Eigen::Index>(contacts.size()), static_cast<Eigen::Index>(fit.fitted.size()));
  for (std::size_t k = 0; k < fit.fitted.size(); ++k) {
    const BallParameter& p = fit.parameters[static_cast<std::size_t>(fit.fitted[k])];
    const bool tilt = p.kind == BallParameter::Kind::kTilt;
    const double step = tilt ? 1e-6 : 1e-4;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      double gaps[2];
      for (const int sign : {0, 1}) {
        ActualChain chain = truth;
        Vec3 ball = ball_B;
        double reach = kReach;
        const double d = sign ? step : -step;
        if (p.kind == BallParameter::Kind::kBall) ball[p.component] += d;
        if (p.kind == BallParameter::Kind::kRadius) reach += d;
        if (p.joint >= 0)
          (tilt ? find_axis(chain, p.joint)->location.tilt
                : find_axis(chain, p.joint)->location.offset)[p.component] += d;
        gaps[sign] = gap_of(chain, contacts[i].q, ball, kStylus, reach);
      }
      J(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = (gaps[1] - gaps[0]) / (2 * step);
    }
  }
  const Eigen::VectorXd scale = J.colwise().norm();  // for the inverse's digits: tilts are rad
  const Eigen::MatrixXd S = J * scale.cwiseInverse().asDiagonal();
  return noise_mm * (S.transpose() * S).inverse().diagonal().cwiseSqrt().cwiseQuotient(scale);
}

const BallParameter& named(const BallFit& fit, const std::string& name) {
  const auto found = std::find_if(fit.parameters.begin(), fit.parameters.end(),
                                  [&](const BallParameter& p) { return p.name == name; });
  return *found;
}

std::vector<std::string> untold(const BallFit& fit) {
  std::vector<std::string> names;
  for (const BallParameter& p : fit.parameters)
    if (!p.unknown.empty()) names.push_back(p.name);
  return names;
}

TEST(BallFit, WithoutNoiseTheErrorsAreFoundExactly) {
  const ActualChain nominal = chain_of("cradle", 0), truth = chain_of("cradle", 1);
  const BallFit fit = fit_ball(nominal, touch(nominal, truth, kBall, kTwelve, 0, any));
  EXPECT_EQ(untold(fit), (std::vector<std::string>{"stylus.x", "stylus.y", "stylus.z"}));
  for (const int i : fit.fitted) {
    const BallParameter& p = fit.parameters[static_cast<std::size_t>(i)];
    EXPECT_NEAR(p.value, true_value(p, truth, kBall), p.kind == BallParameter::Kind::kTilt ? 1e-11 : 1e-9)
        << p.name;
  }
  EXPECT_LT(fit.noise_mm, 1e-9);
  EXPECT_GT(fit.before_mm, 0.02) << "errors of 50 um move a ball by about that";
}

// What the machine knows already is where the search begins, and what cannot be told stays.
TEST(BallFit, KnownErrorsAreTheStart) {
  const ActualChain truth = chain_of("cradle", 1);
  const BallFit fit = fit_ball(truth, touch(chain_of("cradle", 0), truth, kBall, kTwelve, 0, any));
  EXPECT_LT(fit.before_mm, 1e-9);
  EXPECT_NEAR(named(fit, "C.ey0").value, -0.0513, 1e-9);
}

// Many calibrations with 1 um of noise: no estimator can scatter less than the bound, and this one reaches
// it.
TEST(BallFit, IsAsGoodAsTheCramerRaoBound) {
  const int runs = test::long_form() ? 4000 : 400;
  const ActualChain nominal = chain_of("cradle", 0), truth = chain_of("cradle", 1);
  std::mt19937 random(7);
  Eigen::VectorXd bound, sum, squares, told;
  BallFit fit;
  for (int run = 0; run < runs; ++run) {
    const auto contacts = touch(nominal, truth, kBall, kTwelve, kNoise, random);
    fit = fit_ball(nominal, contacts);
    const auto n = static_cast<Eigen::Index>(fit.fitted.size());
    if (run == 0) {
      bound = bound_of(fit, truth, kBall, contacts, kNoise);
      sum = squares = told = Eigen::VectorXd::Zero(n);
    }
    ASSERT_EQ(n, 12);
    for (Eigen::Index k = 0; k < n; ++k) {
      const BallParameter& p =
          fit.parameters[static_cast<std::size_t>(fit.fitted[static_cast<std::size_t>(k)])];
      const double error = p.value - true_value(p, truth, kBall);
      sum[k] += error;
      squares[k] += error * error;
      told[k] += p.deviation;
    }
  }
  double worst = 0, best = 10, bias = 0;
  for (Eigen::Index k = 0; k < bound.size(); ++k) {
    const std::string& name =
        fit.parameters[static_cast<std::size_t>(fit.fitted[static_cast<std::size_t>(k)])].name;
    const double mean = sum[k] / runs, scatter = std::sqrt(squares[k] / runs - mean * mean);
    EXPECT_LT(scatter, 1.3 * bound[k]) << name;
    EXPECT_GT(scatter, bound[k] / 1.3) << name;
    EXPECT_LT(std::abs(mean), 3 * bound[k] / std::sqrt(runs)) << name;
    EXPECT_NEAR(told[k] / runs, bound[k], 0.05 * bound[k]) << name << ": the standard error that is told";
    worst = std::max(worst, scatter / bound[k]);
    best = std::min(best, scatter / bound[k]);
    bias = std::max(bias, std::abs(mean) / bound[k]);
  }
  RecordProperty("scatter_over_bound", std::to_string(best) + " to " + std::to_string(worst));
  std::printf("scatter over the bound %.3f to %.3f, bias over it at most %.3f, %d runs\n", best, worst, bias,
              runs);
}

// With A at rest its errors cannot be told from where the ball is; those of C across its axis can.
TEST(BallFit, SaysWhatThePositionsDoNotTellAndWhy) {
  const ActualChain nominal = chain_of("cradle", 0), truth = chain_of("cradle", 1);
  const Pairs level = {{0, 0}, {0, 60}, {0, 120}, {0, 180}, {0, -120}, {0, -60}};
  const BallFit fit = fit_ball(nominal, touch(nominal, truth, kBall, level, 0, any));
  EXPECT_NE(named(fit, "A.ez0").unknown.find("acts like 1 ball.z"), std::string::npos)
      << named(fit, "A.ez0").unknown;
  EXPECT_EQ(named(fit, "A.ez0").value, 0);
  EXPECT_EQ(named(fit, "C.ex0").unknown, "");
  EXPECT_NE(named(fit, "C.ey0").unknown.find("A.ey0"), std::string::npos) << named(fit, "C.ey0").unknown;
  EXPECT_LT(fit.noise_mm, 1e-4);
}

// A head turns the tool, not the ball: the place of its C axis is that of the ball, the length of the stylus
// is told.
TEST(BallFit, AHeadTellsTheStylusAndNotWhereItHangs) {
  const ActualChain nominal = chain_of("head", 0), truth = chain_of("head", 1);
  const Vec3 ball(30, -20, -300);
  std::vector<BallContact> contacts = touch(nominal, truth, ball, kTwelve, 0, any);
  for (BallContact& contact : contacts) contact.stylus_S.z() += 0.02;  // 20 um shorter than it is
  const BallFit fit = fit_ball(nominal, contacts);
  EXPECT_NE(named(fit, "C.ex0").unknown.find("acts like -1 ball.x"), std::string::npos);
  EXPECT_NE(named(fit, "C.ey0").unknown.find("acts like -1 ball.y"), std::string::npos);
  EXPECT_NE(named(fit, "A.ez0").unknown.find("acts like -1 ball.z"), std::string::npos);
  EXPECT_EQ(named(fit, "stylus.z").unknown, "");
  EXPECT_LT(fit.noise_mm, 1e-4);
}

TEST(BallFit, ContactsThatAreNoBallAreRefused) {
  const ActualChain nominal = chain_of("cradle", 0);
  std::vector<BallContact> contacts = touch(nominal, nominal, kBall, kTwelve, 0, any);
  EXPECT_THROW(fit_ball(nominal, {contacts.begin(), contacts.begin() + 4}), std::runtime_error);
  EXPECT_THROW(fit_ball(nominal, std::vector<BallContact>(20, contacts[0])), std::runtime_error);
}

// What a plan says of contacts is the bound at these contacts.
TEST(BallInformation, IsTheBoundOfTheContacts) {
  const ActualChain nominal = chain_of("cradle", 0);
  const auto contacts = touch(nominal, nominal, kBall, kTwelve, 0, any);
  const BallFit fit = fit_ball(nominal, contacts);
  const Eigen::VectorXd bound = bound_of(fit, nominal, kBall, contacts, kNoise);
  BallInformation information(nominal, kBall, kReach, kNoise);
  const std::vector<double> as_more = information.deviations(contacts);
  information.add(contacts);
  const std::vector<double> added = information.deviations();
  double sum = 0;
  for (Eigen::Index k = 0; k < bound.size(); ++k) {
    // The millimetre with which it begins is a millionth of the information.
    EXPECT_NEAR(added[static_cast<std::size_t>(k)], bound[k], 1e-5 * bound[k]);
    EXPECT_NEAR(as_more[static_cast<std::size_t>(k)], added[static_cast<std::size_t>(k)], 1e-9);
    const bool tilt =
        information.parameters()[static_cast<std::size_t>(k)].kind == BallParameter::Kind::kTilt;
    if (k >= 4) sum += std::pow(bound[k] * (tilt ? 100 : 1), 2);
  }
  EXPECT_NEAR(information.axes_mm(), std::sqrt(sum / 8), 1e-5 * information.axes_mm());
}

}  // namespace
}  // namespace trn
