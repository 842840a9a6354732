#include "app/session/plan_time.h"

#include <gtest/gtest.h>

#include <initializer_list>

#include "core/motion.h"

namespace trn {
namespace {

MotionBlock block_of(std::initializer_list<double> durations_s) {
  MotionBlock block;
  for (const double duration_s : durations_s) block.segments[block.segment_count++].duration_s = duration_s;
  return block;
}

TEST(PlanTime, OfABlockIsThatOfAllItsSegments) {
  PlanTime time;
  time.add(block_of({1, 2, 4}));
  EXPECT_DOUBLE_EQ(time.total_s(), 7);
  time.add(block_of({0.5}));
  EXPECT_DOUBLE_EQ(time.total_s(), 7.5);
}

TEST(PlanTime, ADwellIsTheProgramsOwnAndNoOtherEventIs) {
  MotionBlock dwell = block_of({}), output = block_of({});
  dwell.event.kind = QueueEvent::Kind::kDwell;
  dwell.event.value = 3;
  output.event.kind = QueueEvent::Kind::kAnalogOutput;
  output.event.value = 100;
  PlanTime time;
  time.add(dwell);
  time.add(output);
  EXPECT_DOUBLE_EQ(time.total_s(), 3);
  EXPECT_DOUBLE_EQ(time.real_s({.feed = 0.5, .rapid = 0.5, .adaptive = 0.5, .spindle = 0.5}), 3)
      << "no override makes it longer";
}

TEST(PlanTime, EveryBlockObeysTheOverridesOfItsKind) {
  MotionBlock rapid = block_of({1}), cut = block_of({2}), thread = block_of({4});
  rapid.rapid = true;
  cut.overrides.feed = cut.overrides.adaptive = true;
  thread.overrides.feed = thread.overrides.adaptive = false;
  PlanTime time;
  time.add(rapid);
  time.add(cut);
  time.add(thread);
  EXPECT_DOUBLE_EQ(time.rapid_s(), 1);
  EXPECT_DOUBLE_EQ(time.real_s({.rapid = 0.25}), 4 + 2 + 4);
  EXPECT_DOUBLE_EQ(time.real_s({.feed = 0.5, .adaptive = 0.5}), 1 + 8 + 4);
}

// A run is what lies between something else: three blocks of rapid moves are one.
TEST(PlanTime, CountsRunsOfRapidMoves) {
  MotionBlock rapid = block_of({1});
  rapid.rapid = true;
  PlanTime first;
  for (int i = 0; i < 3; ++i) first.add(rapid);
  first.add(block_of({1}));
  EXPECT_EQ(first.rapid_runs(), 1);
  PlanTime whole = first;
  whole.add(rapid);
  EXPECT_EQ(whole.rapid_runs(), 2);
  const PlanTime rest = whole - first;
  EXPECT_EQ(rest.rapid_runs(), 1);
  EXPECT_DOUBLE_EQ(rest.rapid_s(), 1);
  EXPECT_DOUBLE_EQ(rest.total_s(), 1);
}

}  // namespace
}  // namespace trn
