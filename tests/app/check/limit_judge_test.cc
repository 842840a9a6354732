#include "app/check/limit_judge.h"

#include <gtest/gtest.h>

// The judge alone, without a file: rows as a recorder of setpoints would give them.
namespace trn {
namespace {

constexpr double kStep = 0.001;

Joints one_joint() { return {{"X", JointKind::kLinear, {-10, 30, 50, 500, 6000}}}; }

TraceRow row(double t_s, double q, std::uint32_t line = 0) { return {t_s, {q}, {{12, 15}}, line, 0}; }

LimitJudge judged(const std::vector<double>& q) {
  LimitJudge judge(one_joint(), kStep);
  for (std::size_t i = 0; i < q.size(); ++i)
    judge.row(row(static_cast<double>(i) * kStep, q[i], static_cast<std::uint32_t>(i + 1)));
  judge.finish();
  return judge;
}

TEST(LimitJudge, AJointThatStandsUsesNothingButItsPosition) {
  const LimitJudge judge = judged(std::vector<double>(20, 0.1 * 3));
  for (const Quantity quantity : {Quantity::kVelocity, Quantity::kAcceleration, Quantity::kJerk})
    EXPECT_EQ(judge.verdicts()[0].peak(quantity).ratio, 0) << to_string(quantity);
  EXPECT_NEAR(judge.verdicts()[0].peak(Quantity::kPosition).ratio, 9.7 / 20, 1e-12) << "from the middle, 10";
  EXPECT_TRUE(judge.within_limits());
}

// As behind homing at the range's end, 30: it may stay and come in. Farther out, or out again, is over.
TEST(LimitJudge, FromOutsideTheWayInIsOpen) {
  const double d = 1e-7;
  EXPECT_TRUE(judged({31, 31, 31}).within_limits());
  EXPECT_TRUE(judged({31, 31 - d, 31 - d}).within_limits());
  const auto over = [](const std::vector<double>& q) {
    return judged(q).verdicts()[0].peak(Quantity::kPosition).over;
  };
  EXPECT_EQ(over({31, 31.01, 31.01}), 2u) << "farther out";
  EXPECT_EQ(over({31, 30.5, 30.8, 29, 30.5}), 2u) << "out again, from outside and from inside";
  EXPECT_EQ(over({30, 30.5}), 1u);
  LimitJudge pieces(one_joint(), kStep);
  for (const double q : {20.0, 20.0}) pieces.row(row(0, q));
  pieces.row(row(kStep, 31));
  EXPECT_EQ(pieces.verdicts()[0].peak(Quantity::kPosition).over, 1u);
  pieces.next_piece();
  pieces.row(row(2 * kStep, 32));
  EXPECT_EQ(pieces.verdicts()[0].peak(Quantity::kPosition).over, 1u) << "the drives had no power in between";
}

// One step of d: the first differences are d, 0; the second d, -d; the third d, -2d, d.
TEST(LimitJudge, AStepHasTheDifferencesOfAStep) {
  const double d = 1e-7;
  const LimitJudge judge = judged({0, 0, d, d, d, d});
  const JointVerdict& verdict = judge.verdicts()[0];
  EXPECT_NEAR(verdict.peak(Quantity::kVelocity).value, d / kStep, 1e-15);
  EXPECT_NEAR(verdict.peak(Quantity::kAcceleration).value, d / kStep / kStep, 1e-12);
  EXPECT_NEAR(verdict.peak(Quantity::kJerk).value, -2 * d / kStep / kStep / kStep, 1e-9);
  EXPECT_EQ(verdict.peak(Quantity::kVelocity).line, 3u);
  EXPECT_EQ(verdict.peak(Quantity::kJerk).line, 4u);
  EXPECT_TRUE(judge.within_limits());
}

TEST(LimitJudge, AStreamThatEndsInMotionIsCaughtAtItsEnd) {
  std::vector<double> q;
  for (int i = 0; i < 200; ++i) q.push_back(i < 100 ? 0 : 1e-12 * (i - 99.0) * (i - 99.0) * (i - 99.0));
  EXPECT_TRUE(judged(q).within_limits());
  q.push_back(q.back() + 0.02);  // 20 mm/s, from one row to the next
  const LimitJudge judge = judged(q);
  EXPECT_FALSE(judge.within_limits());
  EXPECT_EQ(judge.verdicts()[0].peak(Quantity::kJerk).over, 3u) << "the jump and two rows behind it";
}

// 0.3 written with 12 decimals is right to 0.5e-12; a difference adds that up with the weights 1 1, 1 2 1, 1
// 3 3 1.
TEST(LimitJudge, WhatRoundingCanAddIsSaidOfEveryQuantity) {
  const LimitJudge judge = judged({0, 0.3, 0.3, 0});
  const auto resolution = [&](Quantity quantity) {
    return judge.verdicts()[0].peak(quantity).resolution_ratio;
  };
  EXPECT_NEAR(resolution(Quantity::kPosition), 0.5e-12 / 20, 1e-24) << "the half range is 20 mm";
  EXPECT_NEAR(resolution(Quantity::kVelocity), 2 * 0.5e-12 / 1e-3 / 50, 1e-20);
  EXPECT_NEAR(resolution(Quantity::kAcceleration), 4 * 0.5e-12 / 1e-6 / 500, 1e-18);
  EXPECT_NEAR(resolution(Quantity::kJerk), 8 * 0.5e-12 / 1e-9 / 6000, 1e-15);
}

TEST(LimitJudge, ANewPieceBeginsAtRestWhereItIs) {
  LimitJudge judge(one_joint(), kStep);
  judge.row(row(0, 1));
  judge.next_piece();
  judge.row(row(1, 25));
  judge.finish();
  EXPECT_TRUE(judge.within_limits());
  EXPECT_EQ(judge.rows(), 2u);
}

}  // namespace
}  // namespace trn
