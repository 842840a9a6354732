#include "kernel/single_block.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "core/axes.h"
#include "core/frames.h"
#include "kernel/rate_plan.h"

// Lines of 0.1 s each along X by hand.
namespace trn {
namespace {

MotionBlock line_block(double from, std::uint32_t line, bool ends_at_rest = false, double duration_s = 0.1) {
  Words a = Words::Zero(), b = Words::Zero();
  a[kX] = from;
  b[kX] = from + 0.1;
  MotionBlock block;
  block.piece = make_line(a, b);
  block.segment_count = 1;
  block.segments[0] = {duration_s, 0, 1, 0, 0};
  block.source.line = line;
  block.ends_at_rest = ends_at_rest;
  return block;
}

class SingleBlockTest : public testing::Test {
 protected:
  void push(std::uint32_t line, bool ends_at_rest = false) {
    ASSERT_TRUE(queue.push(line_block(0.1 * count++, line, ends_at_rest)));
    queue.look();
  }
  MotionQueue queue{16};
  Interpolator interpolator{queue, Pose{}};
  SingleBlock single{queue, interpolator};
  int count = 0;
};

// What is left of the line takes 5 ns: the machine has come to rest in front of it, and never gets there.
TEST_F(SingleBlockTest, ALineMayEndWithBlocksThatTakeNoTime) {
  single.set(true);
  push(1);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(queue.push(line_block(0.1, 1, false, 1e-9)));
  push(2);
  EXPECT_FALSE(single.pauses(true)) << "the first line is released";
  interpolator.advance(0.1 - 2e-9);
  EXPECT_TRUE(single.pauses(true));
  single.release();
  EXPECT_FALSE(single.pauses(true));
  EXPECT_EQ(single.to_line_end_s(1e9), RateWish::kNoStop) << "line 2 has no end yet";
}

TEST_F(SingleBlockTest, WhatWasTypedInIsNotHeld) {
  single.set(true);
  push(1, true);
  push(2, true);
  push(3, true);
  single.begin(true);
  EXPECT_FALSE(single.pauses(true));
  interpolator.advance(0.1);
  EXPECT_FALSE(single.pauses(true)) << "MDI of two lines";
  EXPECT_EQ(single.to_line_end_s(1e9), RateWish::kNoStop);
  EXPECT_TRUE(single.on()) << "the switch stays on for the next program";
  single.begin(false);
  EXPECT_FALSE(single.pauses(true)) << "the first line is released";
  interpolator.advance(0.1);
  EXPECT_TRUE(single.pauses(true));
}

TEST_F(SingleBlockTest, OffItNeverPauses) {
  push(1, true);
  push(2, true);
  EXPECT_FALSE(single.pauses(true));
  interpolator.advance(0.1);
  EXPECT_FALSE(single.pauses(true));
  EXPECT_EQ(single.to_line_end_s(1e9), RateWish::kNoStop);
}

TEST_F(SingleBlockTest, ItStandsBehindALineThatEndsAtRestUntilReleased) {
  single.set(true);
  push(1, true);
  push(2, true);
  push(3, true);
  EXPECT_FALSE(single.pauses(true)) << "the first line is released";
  interpolator.advance(0.1);
  EXPECT_TRUE(single.pauses(true));
  EXPECT_FALSE(single.pauses(false)) << "not while it moves";
  single.release();
  EXPECT_FALSE(single.pauses(true));
  interpolator.advance(0.1);
  EXPECT_TRUE(single.pauses(true));
}

TEST_F(SingleBlockTest, TheEndOfALineInTheMiddleOfAStretchIsFound) {
  single.set(true);
  push(1);
  push(1);
  push(2);
  push(3, true);
  single.pauses(true);
  EXPECT_EQ(single.to_line_end_s(1e9), RateWish::kNoStop) << "it has not begun";
  interpolator.advance(0.03);
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.17, 1e-12);
  EXPECT_EQ(single.to_line_end_s(0.05), RateWish::kNoStop) << "beyond the horizon";
  interpolator.advance(0.1);
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.07, 1e-12);
}

TEST_F(SingleBlockTest, ALineThatEndsAtRestNeedsNoStopOfItsOwn) {
  single.set(true);
  push(1);
  push(1, true);
  push(2, true);
  single.pauses(true);
  interpolator.advance(0.03);
  EXPECT_EQ(single.to_line_end_s(1e9), RateWish::kNoStop);
}

// The line that motion goes on with is released, which is the next one where the last is as good as done.
TEST_F(SingleBlockTest, SwitchedOnWithinALineItEndsWithThatLine) {
  push(1);
  push(2);
  push(3, true);
  interpolator.advance(0.06);
  single.set(true);
  single.pauses(false);
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.04, 1e-12);
  single.set(false);
  interpolator.advance(0.04 - 5e-7);
  single.set(true);
  single.pauses(false);
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.1 + 5e-7, 1e-12);
}

TEST_F(SingleBlockTest, ALineThatWasRunOverCountsAsReleased) {
  single.set(true);
  push(1);
  push(2);
  push(3, true);
  single.pauses(true);
  interpolator.advance(0.05);
  single.pass_line();
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.05, 1e-12) << "still line 1";
  interpolator.advance(0.08);
  EXPECT_NEAR(single.to_line_end_s(1e9), 0, 1e-12) << "line 2 has begun and was not released";
  single.pass_line();
  EXPECT_NEAR(single.to_line_end_s(1e9), 0.07, 1e-12);
}

}  // namespace
}  // namespace trn
