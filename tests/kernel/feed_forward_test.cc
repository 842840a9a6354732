#include "kernel/feed_forward.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/joint_model.h"
#include "core/ports.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/paths.h"

// What the drives are told in advance, against the joints of the plan themselves.
namespace trn {
namespace {

constexpr double kPeriodS = 0.001;
const std::string kProgram =
    "G64 P0.02\nG1 F9000 X40 Y10 Z5 A20 C30\nX60 Y-20 A-10 C80\nG0 X0 Y0 A0 C0\nM2\n";

/// Models that are an inertia of 1 only, so that the force is the acceleration.
FeedForwardConfig unit_inertias(std::size_t joints, double delay_periods) {
  FeedForwardConfig config;
  JointModel model;
  model.inertia = 1;
  config.delay_periods = delay_periods;
  config.models.assign(joints, model);
  return config;
}

const PlannedMotion& motion() {
  static const PlannedMotion made(source_dir() + "/configs/cradle.toml", "M428\n" + kProgram);
  return made;
}

Setpoints zeros() {
  Setpoints out;
  out.q = out.qd = out.velocity_offset = out.force_offset =
      JointVec::Zero(static_cast<Eigen::Index>(motion().joints().size()));
  return out;
}

/// Greatest difference of told and true velocity and acceleration, over the limits.
struct Worst {
  double v = 0, a = 0;
};

// The truth is a difference of the plan's joints about the moment, over a time much shorter than a period.
Worst compare(double rate, double delay_periods) {
  const Joints& joints = motion().joints();
  RateBench bench(motion(), 4096);
  FeedForward feed_forward(unit_inertias(joints.size(), delay_periods), joints, kPeriodS);
  Worst worst;
  Setpoints told = zeros();
  const double h = 2e-5;
  int compared = 0;
  while (!bench.interpolator().at_rest() || bench.time_s() == 0) {
    bench.tick(rate, 1, [](double) {});
    const JointVec q = motion().q(bench.time_s());
    feed_forward.follow_plan(bench.queue(), bench.interpolator().place(), bench.rate().follower());
    feed_forward.tell(q, told);
    const double at = bench.time_s() + rate * delay_periods * kPeriodS;
    // Where the rate is not yet the wished one, and at the ends, the moment is another.
    if (std::abs(bench.rate().rate() - rate) > 1e-12 || at < 0.05 || at > motion().length_s() - 0.05)
      continue;
    const JointVec before = motion().q(at - h), here = motion().q(at), behind = motion().q(at + h);
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      const JointLimit& limit = joints[static_cast<std::size_t>(i)].limit;
      const double v = rate * (behind[i] - before[i]) / (2 * h);
      const double a = rate * rate * (behind[i] - 2 * here[i] + before[i]) / (h * h);
      worst.v = std::max(worst.v, std::abs(told.velocity_offset[i] - v) / limit.velocity);
      worst.a = std::max(worst.a, std::abs(told.force_offset[i] - a) / limit.acceleration);
    }
    ++compared;
  }
  EXPECT_GT(compared, 200);
  return worst;
}

TEST(FeedForward, OnThePathIsThePlansOwnVelocityAndAcceleration) {
  const Worst worst = compare(1, 0);
  std::printf("    velocity off by %.1e, acceleration by %.1e of the limit\n", worst.v, worst.a);
  EXPECT_LT(worst.v, 1e-4);
  EXPECT_LT(worst.a, 3e-3);
}

TEST(FeedForward, IsOfTheMomentAtWhichTheSetpointActs) {
  for (const double delay : {0.3, 1.0, 2.75, 6.0}) {
    const Worst worst = compare(1, delay);
    EXPECT_LT(worst.v, 1e-4) << delay;
    EXPECT_LT(worst.a, 3e-3) << delay;
  }
}

// Between two moments it is linear: off by at most jerk T^2 / 8 and jerk T / 4 in a period with a step of
// jerk.
TEST(FeedForward, OfTheMiddleOfAPeriodLiesBetweenItsEnds) {
  const Worst worst = compare(1, -0.5);
  EXPECT_LT(worst.v, 1e-3);
  EXPECT_LT(worst.a, 1e-2);
}

TEST(FeedForward, GoesWithTheRateOfTheMotion) {
  for (const double rate : {0.5, 0.25}) {
    const Worst worst = compare(rate, 1.5);
    EXPECT_LT(worst.v, 1e-4) << rate;
    EXPECT_LT(worst.a, 3e-3) << rate;
  }
}

// Of a moment that is not queued yet nobody knows the motion: nothing is told, and what was told is not kept.
TEST(FeedForward, TellsNothingOfWhatIsNotQueuedYet) {
  constexpr double kDelay = 8;
  RateBench bench(motion(), 3);
  const double queued_s = bench.queue().buffered_s();
  ASSERT_LT(queued_s, motion().rest_after(0) - 0.1) << "the queue ends within the motion";
  FeedForward feed_forward(unit_inertias(motion().joints().size(), kDelay), motion().joints(), kPeriodS);
  Setpoints told = zeros();
  int known = 0, unknown = 0;
  for (int i = 0; i < 20000 && bench.time_s() < queued_s - 2 * kPeriodS; ++i) {
    bench.tick(1, 1, [](double) {});
    feed_forward.follow_plan(bench.queue(), bench.interpolator().place(), bench.rate().follower());
    feed_forward.tell(motion().q(bench.time_s()), told);
    const double at = bench.time_s() + kDelay * kPeriodS * bench.rate().rate();
    if (bench.rate().rate() < 1 - 1e-12 || at < 0.05 || std::abs(at - queued_s) < 1e-6) continue;
    const bool queued = at < queued_s;
    queued ? ++known : ++unknown;
    ASSERT_EQ(told.velocity_offset.isZero(0), !queued) << at << " of " << queued_s;
    ASSERT_EQ(told.force_offset.isZero(0), !queued) << at << " of " << queued_s;
  }
  EXPECT_GT(known, 10);
  EXPECT_GT(unknown, 4);
}

// While the rate changes, the velocity of the stream is q' r; the truth is the stream of setpoints itself.
TEST(FeedForward, FollowsAHoldToRest) {
  const Joints& joints = motion().joints();
  RateBench bench(motion(), 4096);
  FeedForward feed_forward(unit_inertias(joints.size(), 0), joints, kPeriodS);
  Setpoints told = zeros();
  std::vector<JointVec> q, v, a;
  for (int i = 0; i < 1500; ++i) {
    bench.tick(i < 150 ? 1 : 0, 1, [](double) {});
    q.push_back(motion().q(bench.time_s()));
    feed_forward.follow_plan(bench.queue(), bench.interpolator().place(), bench.rate().follower());
    feed_forward.tell(q.back(), told);
    v.push_back(told.velocity_offset);
    a.push_back(told.force_offset);
  }
  ASSERT_TRUE(bench.rate().standing());
  EXPECT_TRUE(v.back().isZero(0));
  EXPECT_TRUE(a.back().isZero(0));
  for (std::size_t k = 140; k + 1 < q.size(); ++k)
    for (Eigen::Index i = 0; i < q[k].size(); ++i) {
      const JointLimit& limit = joints[static_cast<std::size_t>(i)].limit;
      const double mean = (q[k + 1][i] - q[k - 1][i]) / (2 * kPeriodS);
      const double bend = (q[k + 1][i] - 2 * q[k][i] + q[k - 1][i]) / (kPeriodS * kPeriodS);
      ASSERT_NEAR(v[k][i], mean, limit.jerk * kPeriodS * kPeriodS) << "joint " << i << " period " << k;
      ASSERT_NEAR(a[k][i], bend, limit.jerk * kPeriodS) << "joint " << i << " period " << k;
    }
}

// Off the path there are setpoints only; a motion of constant jerk is known from four of them.
TEST(FeedForward, OfAJogComesFromItsSetpoints) {
  const Joints& joints = motion().joints();
  FeedForward feed_forward(unit_inertias(joints.size(), 2), joints, kPeriodS);
  Setpoints told = zeros();
  const auto at = [&](double t) -> JointVec {
    return JointVec::Constant(told.q.size(), 1 + t * t * t * 500);
  };
  for (int k = -20; k < 0; ++k) feed_forward.stand(at(0));
  for (int k = 0; k < 100; ++k) {
    const double t = k * kPeriodS;
    feed_forward.follow_setpoints(at(t));
    feed_forward.tell(at(t), told);
    if (k < 4) continue;
    EXPECT_NEAR(told.force_offset[0], 3000 * t, 1e-6 * 3000) << k;
    // Two periods ahead, with the acceleration of now.
    EXPECT_NEAR(told.velocity_offset[0], 1500 * t * t + 2 * kPeriodS * 3000 * t, 1e-6) << k;
  }
  feed_forward.stand(at(0.1));
  feed_forward.tell(at(0.1), told);
  EXPECT_TRUE(told.velocity_offset.isZero(0));
}

TEST(FeedForward, TellsNothingWithoutASection) {
  FeedForward feed_forward(std::nullopt, motion().joints(), kPeriodS);
  Setpoints told = zeros();
  feed_forward.follow_setpoints(JointVec::Ones(5));
  feed_forward.tell(JointVec::Ones(5), told);
  EXPECT_TRUE(told.velocity_offset.isZero(0) && told.force_offset.isZero(0));
}

TEST(FeedForward, AllocatesNothing) {
  const Joints& joints = motion().joints();
  RateBench bench(motion(), 4096);
  FeedForwardConfig config = unit_inertias(joints.size(), 2.5);
  for (auto& model : config.models) {
    model->cogging_pitch = 3;
    model->cogging = {1, 2, 3};
  }
  FeedForward feed_forward(config, joints, kPeriodS);
  Setpoints told = zeros();
  for (int i = 0; i < 50; ++i) bench.tick(1, 1, [](double) {});
  const JointVec q = motion().q(bench.time_s());
  const long before = allocation_count();
  feed_forward.follow_plan(bench.queue(), bench.interpolator().place(), bench.rate().follower());
  feed_forward.tell(q, told);
  feed_forward.follow_setpoints(q);
  feed_forward.tell(q, told);
  feed_forward.stand(q);
  EXPECT_EQ(allocation_count(), before);
}

}  // namespace
}  // namespace trn
