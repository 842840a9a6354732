#include "interp/plan/speed/path_sampler.h"

#include <gtest/gtest.h>

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/move.h"
#include "interp/plan/speed/joint_rates.h"
#include "interp/plan/stages.h"
#include "tests/interp/plan/speed_support.h"

namespace trn::speed_test {
namespace {

using speed::JointRates;
using speed::PathSample;
using speed::PathSampler;

/// One joint on a parabola of x: q = top - (x - 5)^2 / 10.
class ParabolaMap : public JointMap {
 public:
  explicit ParabolaMap(double top, double sign = 1) : top_(top), sign_(sign) {}
  int joint_count() const TRN_RT override { return 1; }
  KinStatus map(const Words& y, const MapContext&, JointVec& q) const TRN_RT override {
    q.resize(1);
    q[0] = sign_ * (top_ - (y[kX] - 5) * (y[kX] - 5) / 10);
    return KinStatus::kOk;
  }

 private:
  double top_, sign_;
};

PlanPiece ten_mm() {
  Words to = Words::Zero();
  to[kX] = 10;
  return plan(make_line(Words::Zero(), to), 100, false, 7);
}

PathSample random_sample(std::mt19937_64& rng, double b_max) {
  std::normal_distribution<double> g;
  PathSample p;
  p.b_max = b_max;
  for (size_t j = 0; j < 3; ++j) {
    p.d1[j] = g(rng);
    p.d2[j] = g(rng);
    p.d3[j] = 3 * g(rng);
  }
  return p;
}

// A joint that turns back between two samples: its turning point counts, where it lies within reach.
TEST(PathSampler, ATurningPointBetweenSamplesMustBeInRange) {
  Joints joints = linear_joints(1);
  joints[0].limit.max = 20;
  joints[0].limit.min = -20;
  const JointRates rates = speed::joint_rates(joints, 1, 1);
  for (const double sign : {1.0, -1.0}) {
    const ParabolaMap inside(19.999, sign), outside(20.001, sign);
    const auto look = [&](const JointMap& map, double reach) {
      PathSampler(joints, map, rates).sample(ten_mm(), {}, 4, 4, reach);  // there q is 19.9: 0.1 less
    };
    EXPECT_NO_THROW(look(inside, 2));
    EXPECT_NO_THROW(look(outside, 0.9)) << "the next sample comes before it turns";
    EXPECT_THROW(look(outside, 1.1), ProgramError);
  }
  try {
    const ParabolaMap outside(20.5);
    PathSampler(joints, outside, rates).sample(ten_mm(), {}, 4, 4, 2);
    FAIL();
  } catch (const ProgramError& error) {
    EXPECT_STREQ(error.what(), "line 7: joint X would reach 20.5000 mm, above its upper limit of 20.0000 mm");
  }
}

// Greatest b at constant speed and at rest, by trying: what P4, P5 and P6 leave.
TEST(PathSampler, BoundsAreTheGreatestThatTheJointsAllow) {
  const Joints joints = linear_joints(3);
  const IdentityMap map({kX, kY, kZ});
  const JointRates rates = speed::joint_rates(joints, 1, 1);
  const PathSampler sampler(joints, map, rates);
  std::mt19937_64 rng(5);
  for (int i = 0; i < 100; ++i) {
    const PathSample p = random_sample(rng, i % 2 ? 1e9 : 400.0);
    const auto bound = sampler.bound(p);
    const auto worst = [&](double b, double a, double jerk) {  // P4, or the worst of P5 and P6
      double use = b / p.b_max;
      for (size_t j = 0; j < 3; ++j) {
        use = std::max(use, std::abs(p.d1[j] * a + p.d2[j] * b) / rates.acceleration[j]);
        use = std::max(use, std::abs(p.d1[j] * jerk + p.d3[j] * b * std::sqrt(b)) / rates.jerk[j]);
      }
      return use;
    };
    EXPECT_LE(worst(0.9999 * bound.b, 0, 0), 1);
    EXPECT_GT(worst(1.0001 * bound.b, 0, 0), 1);
    EXPECT_LE(worst(0, 0.9999 * bound.acceleration, 0), 1);
    EXPECT_GT(worst(0, 1.0001 * bound.acceleration, 0), 1);
    EXPECT_LE(worst(0, 0, 0.9999 * bound.jerk), 1);
    EXPECT_GT(worst(0, 0, 1.0001 * bound.jerk), 1);
  }
}

TEST(PathSampler, SpeedIsBoundedByFeedAndJointVelocity) {
  const Joints joints = linear_joints(1);
  const IdentityMap map({kX});
  const PathSampler sampler(joints, map, speed::joint_rates(joints, 1, 1));
  PlanPiece piece = ten_mm();
  EXPECT_NEAR(sampler.sample(piece, {}, 3, 8, 0).b_max, 100 * 100, 1e-6);
  EXPECT_EQ(sampler.sample(piece, {}, 3, 8, 0).s, 8);
  piece.feed.tip_mm_s = 1e9;
  EXPECT_NEAR(sampler.sample(piece, {}, 3, 3, 0).b_max, 500.0 * 500, 1e-3);
  piece.feed.tip_mm_s = 0;
  EXPECT_THROW(sampler.sample(piece, {}, 3, 3, 0), ProgramError);
}

// A program that asks for a tenth of the acceleration gets joints that are ten times weaker.
TEST(PathSampler, LessTipAccelerationScalesTheDerivatives) {
  const Joints joints = linear_joints(1);
  const IdentityMap map({kX});
  const PathSampler sampler(joints, map, speed::joint_rates(joints, 1, 1));
  PlanPiece piece = ten_mm();
  piece.feed.tip_mm_s2 = 500;  // the joint has 5000
  EXPECT_NEAR(sampler.sample(piece, {}, 3, 3, 0).d1[0], 10, 1e-6);
  EXPECT_NEAR(sampler.bound(sampler.sample(piece, {}, 3, 3, 0)).acceleration, 500, 1e-6);
  piece.feed.tip_mm_s2 = 50000;
  EXPECT_NEAR(sampler.sample(piece, {}, 3, 3, 0).d1[0], 1, 1e-9)
      << "more than the joints have changes nothing";
}

TEST(PathSampler, InterpolationReproducesParabolas) {
  const auto at = [](double s) {
    PathSample p;
    p.s = s;
    p.b_max = 3 - s + 2 * s * s;
    p.d1[0] = 1 + s * s;
    p.d2[1] = 4 * s - s * s;
    p.d3[2] = 7 - 5 * s * s;
    return p;
  };
  const PathSample three[3] = {at(0.3), at(1.1), at(1.5)};
  for (const double s : {0.3, 0.6, 1.3, 1.5, 1.7}) {
    const PathSample p = interpolate(three, s, 3), truth = at(s);
    EXPECT_EQ(p.s, s);
    EXPECT_NEAR(p.b_max, truth.b_max, 1e-13);
    EXPECT_NEAR(p.d1[0], truth.d1[0], 1e-13);
    EXPECT_NEAR(p.d2[1], truth.d2[1], 1e-13);
    EXPECT_NEAR(p.d3[2], truth.d3[2], 1e-13);
  }
}

}  // namespace
}  // namespace trn::speed_test
