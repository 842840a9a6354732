#include "kernel/path_rate.h"

#include <gtest/gtest.h>

#include <vector>

#include "kernel/motion_queue.h"
#include "kernel/rate_plan.h"
#include "kernel/rate_plans.h"

// What the tick asks, and when; what it follows where answers come, are late, or are no longer wanted.
namespace trn {
namespace {

constexpr double kPeriodS = 0.001;

/// Down by `u` for a time, and then constant.
RatePlan slowing(double u, double time_s, double end_rate) {
  RatePlan plan;
  plan.steps[0] = {time_s, -u};
  plan.steps[1] = {time_s, u};
  plan.count = 2;
  plan.end_rate = end_rate;
  plan.stops = end_rate == 0;
  return plan;
}

struct PlannedByHand : RatePlans {
  void ask(const RateRequest& request) noexcept override { asked.push_back(request); }
  bool take(const RatePlan*& plan) TRN_RT override {
    if (late) return false;
    ++taken;
    plan = answer;
    return true;
  }
  bool forget() TRN_RT override {
    forgotten += !late;
    return !late;
  }
  const RatePlan* stop(int index) TRN_RT override { return index < stops ? in_store : nullptr; }

  std::vector<RateRequest> asked;
  const RatePlan* answer = nullptr;
  const RatePlan* in_store = nullptr;
  int stops = 3;  ///< of kStopLeads: these many are found
  bool late = false;
  int taken = 0, forgotten = 0;
};

class PathRateProtocol : public testing::Test {
 protected:
  double steps(int periods, const RateWish& wish) {
    double passed_s = 0;
    for (int i = 0; i < periods; ++i) passed_s += rate_.step(queue_, {3, 0, 0}, wish);
    return passed_s;
  }
  // To rest from rate 1: r' goes to -1/t and back, so that r falls by 1 in twice t.
  const RatePlan stop_ = slowing(1e4, 0.01, 0);
  const RatePlan slow_ = slowing(5e3, 0.01, 0.5);
  const int lead_ = rate_lead_periods(kPeriodS);
  MotionQueue queue_{16};
  PlannedByHand plans_;
  PathRate rate_{plans_, kPeriodS};
};

TEST_F(PathRateProtocol, AsksOnceALeadAndTakesTheAnswerOneLeadLater) {
  rate_.start(queue_, 1);
  EXPECT_TRUE(plans_.asked.empty()) << "the path's own start is the ramp";
  plans_.answer = &slow_;
  steps(lead_, {0.5});
  ASSERT_EQ(plans_.asked.size(), 1u);
  EXPECT_EQ(plans_.asked[0].wish.rate, 0.5);
  EXPECT_EQ(plans_.asked[0].place.block, 3u);
  EXPECT_EQ(plans_.taken, 0);
  EXPECT_EQ(rate_.rate(), 1) << "nothing is followed before its time";
  steps(1, {0.5});
  EXPECT_EQ(plans_.taken, 1);
  EXPECT_EQ(plans_.asked.size(), 2u);
  EXPECT_LT(rate_.rate(), 1);
  plans_.answer = nullptr;  // nothing is better than what is in force
  steps(30, {0.5});
  EXPECT_DOUBLE_EQ(rate_.rate(), 0.5);
  EXPECT_EQ(rate_.late_answers(), 0u);
}

TEST_F(PathRateProtocol, AsksRarelyWhileNothingChangesAndAtOnceWhenSomethingDoes) {
  plans_.in_store = &stop_;
  rate_.start(queue_, 1);
  steps(100 * lead_, {1});
  EXPECT_NEAR(static_cast<double>(plans_.asked.size()), 100 / 8.0, 1);
  const std::size_t before = plans_.asked.size();
  steps(2 * lead_, {1});
  const bool open = plans_.asked.size() > before;
  steps(open ? lead_ : 1, {0.7});
  EXPECT_EQ(plans_.asked.back().wish.rate, 0.7);
}

// Without a stop in store it goes on asking.
TEST_F(PathRateProtocol, AsksEveryLeadWhereNoStopIsFound) {
  rate_.start(queue_, 1);
  steps(100 * lead_, {1});
  EXPECT_NEAR(static_cast<double>(plans_.asked.size()), 100, 1);
}

TEST_F(PathRateProtocol, GoesOnWhileAnAnswerIsLateAndStopsWhereNoneComes) {
  rate_.start(queue_, 1);
  plans_.in_store = &stop_;
  steps(lead_ + 1, {1.5});  // the first answer brings the stops, 1, 2 and 3 leads later
  plans_.late = true;
  steps(3 * lead_ - 1, {1.5});
  EXPECT_TRUE(rate_.late());
  EXPECT_EQ(rate_.rate(), 1) << "the plan in force is safe";
  steps(1, {1.5});
  EXPECT_LT(rate_.rate(), 1) << "the last stop in store";
  EXPECT_EQ(rate_.late_answers(), 1u) << "it is told as soon as the machine slows down for it";
  steps(30, {1.5});
  EXPECT_TRUE(rate_.standing());
  EXPECT_EQ(rate_.late_answers(), 1u) << "one answer that is late is one";
  EXPECT_EQ(plans_.asked.size(), 2u) << "one question at a time";
}

TEST_F(PathRateProtocol, AHoldWhileAnswersAreLateBeginsWithTheNextStopInStore) {
  rate_.start(queue_, 1);
  plans_.in_store = &stop_;
  plans_.stops = 8;  // up to 32 leads later
  steps(lead_ + 1, {1.5});
  plans_.late = true;
  steps(6 * lead_, {1.5});
  steps(lead_ - 1, {0});
  EXPECT_EQ(rate_.rate(), 1);
  steps(1, {0});  // 7 leads behind the answer
  EXPECT_LT(rate_.rate(), 1);
  steps(30, {0});
  EXPECT_TRUE(rate_.standing());
}

TEST_F(PathRateProtocol, DropsAnAnswerThatWasLate) {
  rate_.start(queue_, 1);
  plans_.in_store = &stop_;
  steps(lead_ + 1, {1.5});
  plans_.late = true;
  steps(lead_ + 1, {1.5});
  plans_.late = false;
  plans_.answer = &slow_;  // would have begun in the past
  steps(1, {1.5});
  EXPECT_FALSE(rate_.late());
  EXPECT_EQ(rate_.rate(), 1);
  EXPECT_EQ(plans_.forgotten, 1);
  EXPECT_EQ(plans_.taken, 1) << "the first only";
  EXPECT_EQ(plans_.asked.size(), 3u) << "asked anew";
}

// What was asked for before a stop in store began is not wanted, also where it comes late.
TEST_F(PathRateProtocol, DropsAnAnswerThatIsLateForAHold) {
  rate_.start(queue_, 1);
  plans_.in_store = &stop_;
  steps(lead_ + 1, {1.5});
  plans_.late = true;
  steps(lead_, {0});
  plans_.late = false;
  plans_.answer = &slow_;
  steps(1, {0});
  EXPECT_EQ(plans_.taken, 1) << "the first only";
  plans_.answer = nullptr;
  steps(30, {0});
  EXPECT_TRUE(rate_.standing());
}

TEST_F(PathRateProtocol, AHoldBeginsWithTheStopInStore) {
  rate_.start(queue_, 1);
  plans_.in_store = &stop_;
  steps(lead_ + 1, {1.5});
  plans_.answer = &slow_;
  steps(lead_, {0});
  EXPECT_EQ(plans_.forgotten, 1) << "what was asked at rate 1 is no longer wanted";
  EXPECT_LT(rate_.rate(), 1);
  plans_.answer = nullptr;
  steps(30, {0});
  EXPECT_TRUE(rate_.standing());
}

TEST_F(PathRateProtocol, StandsWhileNobodyAnswers) {
  for (int i = 0; i < 5 * lead_; ++i) rate_.rest(queue_);
  EXPECT_GE(plans_.asked.size(), 4u) << "so that it is known before a motion begins";
  EXPECT_FALSE(rate_.late());
  plans_.late = true;
  for (int i = 0; i < 2 * lead_; ++i) rate_.rest(queue_);
  EXPECT_TRUE(rate_.late());
  EXPECT_EQ(rate_.start(queue_, 1), kPeriodS) << "a little late is no reason to wait";
  for (int i = 0; i < 20 * lead_; ++i) rate_.rest(queue_);
  EXPECT_EQ(rate_.late_answers(), 0u) << "nothing moved, and nothing should";
  EXPECT_EQ(rate_.start(queue_, 1), 0);
  EXPECT_EQ(rate_.start(queue_, 1), 0);
  plans_.late = false;
  EXPECT_EQ(rate_.start(queue_, 1), kPeriodS);
  EXPECT_EQ(rate_.late_answers(), 1u) << "a motion waited";
}

}  // namespace
}  // namespace trn
