#include "kernel/interpolator.h"

#include <gtest/gtest.h>

#include <cstdint>

// Blocks along X by hand; every expectation is a place at a time.
namespace trn {
namespace {

using Outcome = Interpolator::Outcome;

Words at_x(double x) {
  Words y = Words::Zero();
  y[kX] = x;
  return y;
}

/// 1 mm/s from `from` for as long as given, in two segments.
MotionBlock moving(double from, double duration_s, std::uint32_t line, bool ends_at_rest = false) {
  MotionBlock block;
  block.piece = make_line(at_x(from), at_x(from + duration_s));
  block.segment_count = 2;
  block.segments[0] = {duration_s / 4, 0, 1, 0, 0};
  block.segments[1] = {duration_s * 3 / 4, duration_s / 4, 1, 0, 0};
  block.source.line = line;
  block.ends_at_rest = ends_at_rest;
  return block;
}

MotionBlock event_of(QueueEvent::Kind kind) {
  MotionBlock block;
  block.event.kind = kind;
  return block;
}

class InterpolatorTest : public testing::Test {
 protected:
  void push(const MotionBlock& block) {
    ASSERT_TRUE(queue.push(block));
    queue.look();
  }
  MotionQueue queue{16};
  Interpolator interpolator{queue, Pose{}};
};

TEST_F(InterpolatorTest, ItIsWhereThePlanIsAtEveryTime) {
  push(moving(0, 0.4, 1));
  push(moving(0.4, 0.2, 2));
  EXPECT_FALSE(interpolator.has_position());
  EXPECT_TRUE(interpolator.at_rest());
  for (int i = 1; i <= 19; ++i) {
    EXPECT_EQ(interpolator.advance(0.03), Outcome::kMoving);
    EXPECT_NEAR(interpolator.y()[kX], 0.03 * i, 1e-12) << i;
    EXPECT_EQ(interpolator.source().line, i < 14 ? 1u : 2u) << i;
    EXPECT_FALSE(interpolator.at_rest());
  }
  EXPECT_EQ(interpolator.place().segment, 1);
  EXPECT_NEAR(interpolator.place().time_s, 0.12, 1e-12);  // 0.17 into the block whose first segment has 0.05
}

TEST_F(InterpolatorTest, AStretchEndsInItsVeryEnd) {
  push(moving(0, 0.1, 1, true));
  push(moving(0.1, 0.1, 2, true));
  EXPECT_EQ(interpolator.advance(0.07), Outcome::kMoving);
  EXPECT_EQ(interpolator.advance(0.07), Outcome::kMoving);
  EXPECT_NEAR(interpolator.y()[kX], 0.1, 1e-15) << "a period for the end";
  EXPECT_TRUE(interpolator.at_rest());
  EXPECT_EQ(interpolator.advance(0.07), Outcome::kMoving);
  EXPECT_NEAR(interpolator.y()[kX], 0.17, 1e-12) << "what was left of the period before does not count";
  EXPECT_EQ(interpolator.advance(0.07), Outcome::kAtRest);
  EXPECT_NEAR(interpolator.y()[kX], 0.2, 1e-15);
  EXPECT_EQ(interpolator.advance(0.07), Outcome::kAtRest);
}

TEST_F(InterpolatorTest, AnEmptyQueueInTheMiddleOfAStretchIsStarvation) {
  push(moving(0, 0.1, 1));
  EXPECT_EQ(interpolator.advance(0.12), Outcome::kStarved);
  EXPECT_NEAR(interpolator.y()[kX], 0.1, 1e-15);
  EXPECT_FALSE(interpolator.at_rest());
  push(moving(0.1, 0.1, 2));
  EXPECT_EQ(interpolator.advance(0.03), Outcome::kMoving);
  EXPECT_NEAR(interpolator.y()[kX], 0.13, 1e-12) << "time that could not pass is forgotten";
}

TEST_F(InterpolatorTest, ItWaitsInFrontOfAnEvent) {
  push(moving(0, 0.1, 1, true));
  push(event_of(QueueEvent::Kind::kDwell));
  push(moving(0.1, 0.1, 2, true));
  EXPECT_EQ(interpolator.advance(0.1), Outcome::kMoving);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(interpolator.advance(0.01), Outcome::kAtEvent);
  EXPECT_EQ(interpolator.event().event.kind, QueueEvent::Kind::kDwell);
  interpolator.pass_event();
  EXPECT_EQ(interpolator.advance(0.01), Outcome::kMoving);
  EXPECT_NEAR(interpolator.y()[kX], 0.11, 1e-12);
}

TEST_F(InterpolatorTest, AnEventInFrontOfTheFirstMotionShowsThatMotionsContext) {
  push(event_of(QueueEvent::Kind::kSpindle));
  MotionBlock first = moving(0, 0.1, 1);
  first.context.tool_offset = Vec3(0, 0, 80);
  push(first);
  EXPECT_EQ(interpolator.advance(0.01), Outcome::kAtEvent);
  EXPECT_EQ(interpolator.context().tool_offset, Vec3(0, 0, 80));
  EXPECT_FALSE(interpolator.has_position());
}

TEST_F(InterpolatorTest, OutputsAreTakenOnceWhereTheirBlockBegins) {
  MotionBlock first = moving(0, 0.1, 1), second = moving(0.1, 0.1, 2);
  first.outputs.put(3, true);
  second.outputs.put(4, true);
  push(first);
  push(second);
  interpolator.advance(0.05);
  EXPECT_EQ(interpolator.take_outputs().set, 1u << 3);
  interpolator.advance(0.04);
  EXPECT_FALSE(interpolator.take_outputs().any());
  interpolator.advance(0.02);
  EXPECT_EQ(interpolator.take_outputs().set, 1u << 4);
}

TEST_F(InterpolatorTest, SkippingLeavesOutTheMotionUpToTheEvent) {
  for (int i = 0; i < 3; ++i) push(moving(0.1 * i, 0.1, static_cast<std::uint32_t>(i + 1)));
  push(event_of(QueueEvent::Kind::kProbeEnd));
  interpolator.advance(0.05);
  EXPECT_TRUE(interpolator.skip_to_event());
  EXPECT_TRUE(interpolator.at_rest());
  EXPECT_NEAR(interpolator.y()[kX], 0.05, 1e-12) << "it stands where it was";
  EXPECT_EQ(interpolator.advance(0.01), Outcome::kAtEvent);
  interpolator.pass_event();
  EXPECT_FALSE(interpolator.skip_to_event()) << "there is none";
}

TEST_F(InterpolatorTest, WhatFollowsASkippedBlockBeginsWithItsOutputs) {
  push(moving(0, 0.1, 1));
  push(event_of(QueueEvent::Kind::kProbeEnd));
  MotionBlock next = moving(0.1, 0.1, 2);
  next.outputs.put(7, true);
  push(next);
  interpolator.advance(0.05);
  ASSERT_TRUE(interpolator.skip_to_event());
  interpolator.pass_event();
  interpolator.advance(0.01);
  EXPECT_EQ(interpolator.take_outputs().set, 1u << 7);
}

TEST_F(InterpolatorTest, AbandonedMotionIsForgotten) {
  push(moving(0, 0.1, 1));
  push(moving(0.1, 0.1, 2));
  interpolator.advance(0.05);
  interpolator.abandon();
  EXPECT_TRUE(interpolator.at_rest());
  EXPECT_FALSE(interpolator.has_position());
  EXPECT_EQ(interpolator.advance(0.01), Outcome::kAtRest);
}

// More blocks that end within one period than any plan has: bounded, and told.
TEST(Interpolator, EndlessBlocksInOnePeriodAreADefect) {
  MotionQueue queue(300);
  Interpolator interpolator(queue, Pose{});
  for (std::uint32_t i = 0; i < 300; ++i) queue.push(moving(0, 1e-9, i));
  queue.look();
  EXPECT_EQ(interpolator.advance(0.001), Outcome::kBroken);
}

}  // namespace
}  // namespace trn
