#include "kernel/motion_queue.h"

#include <gtest/gtest.h>

namespace trn {
namespace {

MotionBlock block_of(double duration_s, std::uint32_t line, bool ends_at_rest = false) {
  MotionBlock block;
  block.segment_count = 1;
  block.segments[0].duration_s = duration_s;
  block.source.line = line;
  block.ends_at_rest = ends_at_rest;
  return block;
}

MotionBlock event_block() {
  MotionBlock block;
  block.event.kind = QueueEvent::Kind::kProgramEnd;
  return block;
}

TEST(MotionQueue, TheReaderSeesWhatWasThereWhenItLooked) {
  MotionQueue queue(4);
  queue.push(block_of(0.5, 7));
  EXPECT_EQ(queue.front(), nullptr) << "it has not looked";
  queue.look();
  ASSERT_NE(queue.front(), nullptr);
  EXPECT_EQ(queue.front()->source.line, 7u);
  queue.push(block_of(0.25, 8));
  EXPECT_EQ(queue.ahead(1), nullptr);
  EXPECT_EQ(queue.seen_number(), 1u);
  queue.look();
  EXPECT_EQ(queue.ahead(1)->source.line, 8u);
  EXPECT_EQ(queue.number_ahead(1), 2u);
  EXPECT_EQ(queue.number_ahead(2), 0u);
  EXPECT_EQ(queue.look_ahead(1).block, queue.ahead(1));
  EXPECT_EQ(queue.look_ahead(1).number, 2u);
  EXPECT_EQ(queue.look_ahead(1).duration_s, 0.25);
  EXPECT_EQ(queue.look_ahead(2).block, nullptr);
  EXPECT_EQ(queue.seen_number(), 2u);
  queue.drop_all();
  EXPECT_EQ(queue.look_ahead(1).block, nullptr);
}

TEST(MotionQueue, AFullQueueTakesNothingAndLosesNothing) {
  MotionQueue queue(3);
  for (std::uint32_t line = 1; line <= 3; ++line) EXPECT_TRUE(queue.push(block_of(1, line)));
  EXPECT_FALSE(queue.push(block_of(1, 4)));
  queue.look();
  for (std::uint32_t line = 1; line <= 3; ++line) {
    ASSERT_EQ(queue.front()->source.line, line);
    queue.pop();
  }
  EXPECT_EQ(queue.front(), nullptr);
  EXPECT_TRUE(queue.push(block_of(1, 5)));
  queue.look();
  EXPECT_EQ(queue.front()->source.line, 5u);
}

TEST(MotionQueue, TimeThatIsAheadBeginsBehindTheBlockThatIsDriven) {
  MotionQueue queue(8);
  queue.push(block_of(0.5, 1));
  queue.push(block_of(0.25, 2));
  EXPECT_NEAR(queue.buffered_s(), 0.75, 1e-9);
  queue.look();
  EXPECT_NEAR(queue.seen_s(), 0.75, 1e-9);
  queue.begin_front();
  queue.begin_front();
  EXPECT_NEAR(queue.buffered_s(), 0.25, 1e-9);
  EXPECT_NEAR(queue.seen_s(), 0.25, 1e-9);
  queue.pop();
  EXPECT_NEAR(queue.seen_s(), 0.25, 1e-9);
  queue.pop();
  EXPECT_EQ(queue.seen_s(), 0);
  EXPECT_NEAR(queue.buffered_s(), 0, 1e-9);
}

TEST(MotionQueue, KnowsWhetherAStopIsAhead) {
  MotionQueue queue(8);
  queue.push(block_of(0.5, 1));
  queue.look();
  EXPECT_FALSE(queue.sees_stop());
  queue.push(block_of(0.5, 2, true));
  EXPECT_TRUE(queue.holds_stop());
  EXPECT_FALSE(queue.sees_stop()) << "not looked yet";
  queue.look();
  EXPECT_TRUE(queue.sees_stop());
  queue.push(block_of(0.5, 3));
  queue.look();
  queue.pop();
  EXPECT_TRUE(queue.sees_stop());
  queue.pop();
  EXPECT_FALSE(queue.sees_stop()) << "the stop has been driven";
  queue.push(event_block());
  queue.look();
  EXPECT_TRUE(queue.sees_stop()) << "events are met at rest";
}

TEST(MotionQueue, ADroppedProgramsBlocksAreSkippedAndTheNextOnesAreNot) {
  MotionQueue queue(64);
  for (std::uint32_t line = 1; line <= 20; ++line) queue.push(block_of(1, line));
  queue.look();
  queue.drop_all();
  queue.push(block_of(1, 21));  // the planner has not heard yet
  queue.look();
  EXPECT_EQ(queue.front(), nullptr);
  queue.begin_generation();
  queue.push(block_of(1, 99));
  queue.look();
  ASSERT_NE(queue.front(), nullptr);
  EXPECT_EQ(queue.front()->source.line, 99u);
  EXPECT_EQ(queue.number_ahead(0), 1u) << "numbers begin anew with each program";
}

TEST(MotionQueue, AnswersArriveInOrderAndOldOnesAreForgotten) {
  MotionQueue queue(4);
  ProgramAnswer answer;
  EXPECT_FALSE(queue.take_answer(answer));
  answer.value = 3;
  queue.answer(answer);
  answer.value = 4;
  queue.answer(answer);
  ASSERT_TRUE(queue.take_answer(answer));
  EXPECT_EQ(answer.value, 3);
  queue.begin_generation();
  EXPECT_FALSE(queue.take_answer(answer)) << "asked by a program that is no more";
}

}  // namespace
}  // namespace trn
