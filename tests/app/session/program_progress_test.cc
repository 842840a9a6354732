#include "app/session/program_progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "app/session/plan_time.h"
#include "app/session/program_step.h"
#include "app/session/program_time.h"
#include "core/motion.h"
#include "kernel/rt_messages.h"

// How long a program still takes, told by reports that are made by hand: the truth is the time they take.
namespace trn {
namespace {

constexpr double kPeriod_s = 1e-3;
constexpr PlanTime::Kind kRapid{.rapid = true}, kFeed{.feed = true};

/// A program of rapid moves and cuts in turn, a second of plan time each.
class ProgramProgressTest : public testing::Test {
 protected:
  static constexpr int kPairs = 10;

  ProgramProgressTest() {
    ProgramTime total;
    for (int i = 0; i < kPairs; ++i) {
      total.time.add(kRapid, 1);
      total.time.add(kFeed, 1);
    }
    total.known = true;
    progress_.set_total(total);
  }
  /// One period of the move that is under way.
  void period(double rate, MotionState motion = MotionState::kMoving) {
    CycleReport report;
    report.motion = motion;
    report.override_now = rate;
    progress_.report(report, &step_, shares_);
  }
  void begin(PlanTime::Kind kind) {
    step_.begins_at = planned_;
    step_.timing = kind;
    step_.moves = true;
    ++step_.source.step;
  }
  /// A second of plan time. `rate`: by the time since its beginning, s. How long it took, s.
  double drive(PlanTime::Kind kind, const std::function<double(double)>& rate) {
    begin(kind);
    double plan_s = 0, time_s = 0;
    for (; plan_s < 1 - kPeriod_s / 100; time_s += kPeriod_s) {
      plan_s += rate(time_s) * kPeriod_s;
      period(rate(time_s));
    }
    planned_.add(kind, 1);
    return time_s;
  }
  double cut() {
    return drive(kFeed, [](double) { return 1; });
  }
  /// The rate needs a tenth of a second until it is at the override.
  double rapid() {
    return drive(kRapid, [this](double time_s) { return time_s < 0.1 ? 1 : shares_.rapid; });
  }
  /// Until the end of the program from the cut of this pair's beginning on, if rapid moves take so long.
  static double left_s(int pair, double rapid_s) { return (kPairs - pair) + (kPairs - 1 - pair) * rapid_s; }

  ProgramProgress progress_{kPeriod_s};
  ProgramStep step_;
  PlanTime planned_;
  OverrideShares shares_;
};

TEST_F(ProgramProgressTest, IsThePlansOwnTimeWithoutOverrides) {
  for (int pair = 0; pair < 3; ++pair) {
    rapid();
    EXPECT_NEAR(progress_.left_s(), left_s(pair, 1), 0.01);
    EXPECT_NEAR(progress_.done_s(), 2 * pair + 1, 0.01);
    cut();
  }
  EXPECT_DOUBLE_EQ(progress_.total_s(), 2 * kPairs);
}

TEST_F(ProgramProgressTest, LearnsWhatRapidMovesSaveAtTheirOverride) {
  shares_.rapid = 0.5;
  double rapid_s = 0;
  for (int pair = 0; pair < 4; ++pair) {
    rapid_s = rapid();
    EXPECT_NEAR(rapid_s, 1.9, 2 * kPeriod_s);
    period(1);
    cut();
  }
  begin(kFeed);
  period(1);
  EXPECT_NEAR(progress_.left_s(), (kPairs - 4) * (1 + rapid_s), 0.1);
}

// Before one was driven, its rate is thought to fall by 6 a second from what it was before.
TEST_F(ProgramProgressTest, BeforeAnyRapidMoveWasDrivenItsRateIsThoughtToFallSteadily) {
  for (const double share : {0.25, 0.5, 0.8}) {
    double rapid_s = 0;
    for (double way_s = 0; way_s < 1; rapid_s += kPeriod_s)
      way_s += std::max(share, 1 - 6 * rapid_s) * kPeriod_s;
    shares_.rapid = share;
    begin(kFeed);
    period(1);
    EXPECT_NEAR(progress_.left_s(), kPairs * (1 + rapid_s), 0.02 * kPairs) << share;
  }
}

// What a hold takes is not of the rapid move.
TEST_F(ProgramProgressTest, ARapidMoveThatWasHeldTeachesNothing) {
  shares_.rapid = 0.5;
  double rapid_s = 0;
  for (int pair = 0; pair < 3; ++pair) {
    rapid_s = rapid();
    cut();
  }
  begin(kRapid);
  for (int i = 0; i < 5000; ++i) period(0, MotionState::kHeld);
  const double held_s = drive(kRapid, [](double) { return 0.5; });
  EXPECT_NEAR(held_s, 2, 0.01);
  cut();
  begin(kFeed);
  period(1);
  EXPECT_NEAR(progress_.left_s(), (kPairs - 4) * (1 + rapid_s), 0.1);
}

TEST_F(ProgramProgressTest, WhatWasLearntAtAnotherOverrideIsForgotten) {
  shares_.rapid = 0.25;
  for (int pair = 0; pair < 3; ++pair) {
    drive(kRapid, [](double time_s) { return time_s < 0.5 ? 1 : 0.25; });  // saves 1.5 s
    cut();
  }
  shares_.rapid = 0.9;
  begin(kFeed);
  period(1);
  EXPECT_NEAR(progress_.left_s(), (kPairs - 3) * (1 + 1 / 0.9), 0.1);
}

// Above 100 % the limits say what is driven of it.
TEST_F(ProgramProgressTest, LearnsAtWhichRateCutsAreDriven) {
  shares_.feed = 1.5;
  for (int pair = 0; pair < 8; ++pair) {
    rapid();
    drive(kFeed, [](double) { return 1.2; });
  }
  begin(kRapid);
  period(1);
  EXPECT_NEAR(progress_.left_s(), 2 + 2 / 1.2, 0.15);
  shares_.feed = 0.5;
  period(1);
  EXPECT_NEAR(progress_.left_s(), 2 + 2 / 0.5, 0.01) << "another override, of which nothing is known yet";
}

// Below 100 % short moves end before the rate is there.
TEST_F(ProgramProgressTest, LearnsAtWhichRateShortCutsAreDriven) {
  shares_.feed = 0.5;
  for (int pair = 0; pair < 8; ++pair) {
    rapid();
    drive(kFeed, [](double) { return 0.7; });
  }
  begin(kRapid);
  period(1);
  EXPECT_NEAR(progress_.left_s(), 2 + 2 / 0.7, 0.2);
}

TEST_F(ProgramProgressTest, WithoutEndNothingIsPromised) {
  begin(kFeed);
  shares_.feed = 0;
  period(0);
  EXPECT_EQ(progress_.left_s(), -1);
  shares_.feed = 1;
  shares_.rapid = 0;
  period(1);
  EXPECT_EQ(progress_.left_s(), -1);
  progress_.begin();
  EXPECT_EQ(progress_.left_s(), -1) << "nothing is known of it";
  EXPECT_EQ(progress_.total_s(), 0);
  EXPECT_FALSE(progress_.known());
}

TEST_F(ProgramProgressTest, AtRestTheProgramHasNotBegun) {
  rapid();
  progress_.lines_change();
  EXPECT_TRUE(progress_.about());
  EXPECT_GT(progress_.done_s(), 0.9);
  progress_.report(CycleReport{}, nullptr, shares_);
  EXPECT_EQ(progress_.done_s(), 0);
  EXPECT_DOUBLE_EQ(progress_.left_s(), 2 * kPairs);
  EXPECT_FALSE(progress_.about());
}

// What waits at an event, as M0, takes no time of the plan.
TEST_F(ProgramProgressTest, WaitingAtAnEventTakesNoPlanTime) {
  rapid();
  const double done_s = progress_.done_s();
  step_.begins_at = planned_;
  step_.timing = {};
  step_.moves = false;
  ++step_.source.step;
  CycleReport report;
  report.motion = MotionState::kMoving;
  report.waits_at.kind = QueueEvent::Kind::kSpindle;
  for (int i = 0; i < 1000; ++i) progress_.report(report, &step_, shares_);
  EXPECT_NEAR(progress_.done_s(), done_s, 1e-9);
}

}  // namespace
}  // namespace trn
