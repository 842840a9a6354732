#include "kernel/joint_jog.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <limits>
#include <numeric>
#include <random>

#include "app/check/limit_judge.h"
#include "core/machine.h"
#include "kernel/s_curve.h"
#include "tests/kernel/planned_motion.h"

namespace trn {
namespace {

constexpr double kJogPeriodS = 1e-3;

Joints jogged_joints() {
  Joints joints(2);
  joints[0].limit = {-100, 100, 200, 2000, 40000};
  joints[1].kind = JointKind::kRotary;
  joints[1].limit = {-1, 1, 2, 10, 200};
  return joints;
}

JointVec stand_at(double x, double a) {
  JointVec q(2);
  q << x, a;
  return q;
}

class Jogging : public testing::Test {
 protected:
  explicit Jogging(const JointVec& from = stand_at(5, 0.3)) : q_(from) {
    jog_.begin(from);
    judge_(from);
  }
  void step(double rate = 1) {
    q_ = jog_.step(rate);
    judge_(q_);
  }
  int finish() {
    int periods = 0;
    for (; !jog_.ended() && periods < 20000; ++periods) step();
    for (int i = 0; i < 4; ++i) step();  // the judge's differences reach so far back
    return periods;
  }
  void keeps_limits() {
    std::string where;
    EXPECT_LE(judge_.worst(&where), 1 + 1e-6) << where;
  }

  const Joints joints_ = jogged_joints();
  JointJog jog_{joints_, kJogPeriodS};
  JointJudge judge_{joints_, kJogPeriodS};
  JointVec q_;
};

TEST(JogTarget, EndsAtTheLimitAndNeverGoesFartherOut) {
  const JointLimit limit{-100, 100, 1, 1, 1};
  EXPECT_EQ(jog_target(limit, 10, 20), 30);
  EXPECT_EQ(jog_target(limit, 90, 20), 100);
  EXPECT_EQ(jog_target(limit, -90, -20), -100);
  EXPECT_EQ(jog_target(limit, 120, 5), 120) << "outside already";
  EXPECT_EQ(jog_target(limit, 120, -5), 115) << "it may come back";
  EXPECT_EQ(jog_target(limit, -120, 300), 100);
}

TEST(MovingMean, IsTheMeanOfTheLastValues) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> any(-50, 50);
  MovingMean mean(9);
  for (const int count : {1, 4, 9}) {
    mean.restart(count);
    std::deque<double> last(static_cast<std::size_t>(count), 0);
    for (int i = 0; i < 40; ++i) {
      last.push_back(any(rng));
      last.pop_front();
      ASSERT_NEAR(mean.push(last.back()), std::accumulate(last.begin(), last.end(), 0.0) / count, 1e-12);
    }
  }
}

// The closed form: the wait, the way at constant speed, and both means' lengths, each rounded up to periods.
TEST_F(Jogging, MovesItsJointAloneTheWholeWayWithinTheLimits) {
  jog_.move_on(0, -40, 150);
  const int periods = finish();
  EXPECT_EQ(q_, stand_at(-35, 0.3));
  keeps_limits();
  const double first_s = std::max(150 / (0.99 * 2000), std::sqrt(2 * 150 / (0.99 * 40000)));
  const double second_s = 2 * 150 / (first_s * 0.99 * 40000);
  EXPECT_NEAR((periods - kStillPeriods) * kJogPeriodS, 40 / 150.0 + first_s + second_s, 3.01 * kJogPeriodS);
}

TEST_F(Jogging, WithoutASpeedTakesATenthOfTheLimitAndNeverMoreThanTheLimit) {
  for (const auto& [asked, expected] : {std::pair{0.0, 20.0}, {9999.0, 200.0}}) {
    jog_.begin(stand_at(-90, 0));
    jog_.move_on(0, 150, asked);
    double fastest = 0, before = -90;
    while (!jog_.ended()) {
      const double x = jog_.step(1)[0];
      fastest = std::max(fastest, (x - before) / kJogPeriodS);
      before = x;
    }
    EXPECT_NEAR(fastest, expected, 1e-6 * expected);
    EXPECT_EQ(before, 60);
  }
}

// As under a button that is let go.
TEST_F(Jogging, StopsWithinTheMeans) {
  jog_.move_on(0, 1e9, 60);
  for (int i = 0; i < 400; ++i) step();
  jog_.move_on(0, 0, 0);
  const double released_at = q_[0];
  const int periods = finish();
  const double first_s = std::max(60 / (0.99 * 2000), std::sqrt(2 * 60 / (0.99 * 40000)));
  const double second_s = 2 * 60 / (first_s * 0.99 * 40000);
  EXPECT_LE(periods * kJogPeriodS, first_s + second_s + 3 * kJogPeriodS);
  EXPECT_GT(q_[0], released_at);
  EXPECT_LT(q_[0] - released_at, 60 * (first_s + second_s));
  keeps_limits();
}

// As under a hand wheel: what is turned on while the joint moves is not lost, and there is no pause between.
TEST_F(Jogging, ATargetThatMovesOnIsReachedWithoutAPause) {
  double slowest = 1e9;
  for (int click = 0; click < 50; ++click) {
    jog_.move_on(0, 0.1, 5);
    for (int i = 0; i < 20; ++i) {
      const double before = q_[0];
      step();
      if (click > 5) slowest = std::min(slowest, (q_[0] - before) / kJogPeriodS);
    }
  }
  EXPECT_NEAR(slowest, 5, 0.01);
  finish();
  EXPECT_NEAR(q_[0], 5 + 50 * 0.1, 1e-12);
  keeps_limits();
}

TEST_F(Jogging, StandsAtTheLimit) {
  jog_.move_on(0, 1e9, 200);
  jog_.move_on(1, -1e9, 0);
  finish();
  EXPECT_EQ(q_, stand_at(100, -1));
  jog_.move_on(0, 5, 200);
  finish();
  EXPECT_EQ(q_, stand_at(100, -1));
  keeps_limits();
}

// A message may hold any number: the smallest speed above 0 turns the demand round as any other does.
TEST_F(Jogging, ReversesBehindAStepTooSmallToBeSeen) {
  const double least = std::numeric_limits<double>::denorm_min();
  jog_.move_on(0, 1e9, 20);
  for (int i = 0; i < 40; ++i) step();
  for (const double speed : {least / kJogPeriodS, 1e-300}) {
    jog_.move_on(0, -1e9, speed);
    step();
    jog_.move_on(0, -1e9, 20);
    for (int i = 0; i < 40; ++i) step();
    jog_.move_on(0, 1e9, 20);
    for (int i = 0; i < 40; ++i) step();
  }
  keeps_limits();
}

// A jog that is asked for in the very period in which another motion came to rest: the jerk with which that
// one ended and the jog's own would add up in one period. The other motions end anywhere between two periods.
TEST(JogBehindAnotherMotion, KeepsTheJerk) {
  std::mt19937_64 rng(11);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng);
  };
  const Joints joints = jogged_joints();
  const JointLimit& limit = joints[0].limit;
  for (int run = 0; run < 400; ++run) {
    const double way = between(-20, 20);
    const SCurve motion(way, limit.velocity, limit.acceleration, limit.jerk);
    const auto at = [&](int period) { return stand_at(motion.at(period * kJogPeriodS), 0); };
    JointJudge judge(joints, kJogPeriodS);
    judge(at(0));
    int period = 1;
    for (; period * kJogPeriodS < motion.duration_s(); ++period) judge(at(period));
    judge(at(period));
    for (int stands = static_cast<int>(between(0, 4)); stands > 0; --stands) judge(at(period));
    JointJog jog(joints, kJogPeriodS);
    jog.begin(stand_at(way, 0));
    jog.move_on(0, std::copysign(between(0.1, 30), between(-1, 1)), between(1, 200));
    JointVec q;
    for (int i = 0; i < 20000 && !jog.ended(); ++i) judge(q = jog.step(1));
    std::string where;
    ASSERT_LE(judge.worst(&where), 1 + 1e-6) << where << " in run " << run;
    ASSERT_NE(q[0], way);
  }
}

// Whatever two hands do: reversals, steps on the way, other speeds, overrides, stops.
TEST_F(Jogging, NothingThatTheOperatorDoesBreaksALimit) {
  std::mt19937_64 rng(7);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng);
  };
  const auto shrunk = [&](double value) {
    return between(0, 1) < 0.1 ? value * std::pow(10, between(-320, 0)) : value;
  };
  double rate = 1;
  long moved = 0;
  for (int i = 0; i < 200000; ++i) {
    if (between(0, 1) < 0.02) {
      const int joint = between(0, 1) < 0.5 ? 0 : 1;
      const double range = joint == 0 ? 100 : 1;
      const double kind = between(0, 1);
      const double way = kind < 0.15  ? 0
                         : kind < 0.4 ? std::copysign(1e9, between(-1, 1))
                                      : shrunk(between(-range, range));
      jog_.move_on(joint, way, between(0, 1) < 0.3 ? 0 : shrunk(between(0, 2.5 * range)));
    }
    if (between(0, 1) < 0.01) rate = between(0, 1) < 0.2 ? 0 : shrunk(between(0, 1));
    if (between(0, 1) < 0.001) jog_.stop();
    const JointVec before = q_;
    step(rate);
    moved += before != q_;
    ASSERT_LE(std::abs(q_[0]), 100);
    ASSERT_LE(std::abs(q_[1]), 1);
  }
  EXPECT_GT(moved, 100000);
  keeps_limits();
  EXPECT_GT(judge_.worst(), 0.9) << "the limits are used";
}

}  // namespace
}  // namespace trn
