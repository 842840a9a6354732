#include "app/daemon/planner_thread.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/motion_queue.h"
#include "tests/support/paths.h"

// The planner's thread before a queue whose tick is played by the test.
namespace trn {
namespace {

class Planner : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  std::string program(const std::string& text) {
    std::ofstream(path_) << text;
    return path_;
  }
  // Half a millimetre at a time, rounded at the corners: hundreds of blocks without a stop between them. X
  // goes to 100 and back.
  static double zigzag_x(int i) { return 0.5 * (i % 400 < 200 ? i % 400 : 400 - i % 400); }
  static std::string zigzag(int lines) {
    std::string text = "G21 G90 G94 G64 P0.01\nG1 F600\n";
    for (int i = 0; i < lines; ++i) text += fmt::format("X{:.1f} Y{:.1f}\n", zigzag_x(i), 0.5 * (i % 2));
    return text + "M2\n";
  }
  /// The next block, as soon as it has come.
  MotionBlock take() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (; std::chrono::steady_clock::now() < end; std::this_thread::yield()) {
      queue_.look();
      if (const MotionBlock* front = queue_.front()) {
        const MotionBlock block = *front;
        queue_.pop();
        return block;
      }
    }
    ADD_FAILURE() << "no block comes";
    return {};
  }
  /// Where the program's last motion ends; takes all of it.
  Words end_of_motion(double* tool_length = nullptr) {
    Words end = Words::Constant(std::nan(""));
    for (MotionBlock block = take(); block.event.kind != QueueEvent::Kind::kProgramEnd; block = take()) {
      if (block.segment_count > 0) end = block.piece.at(block.piece.length);
      if (block.segment_count > 0 && tool_length) *tool_length = block.context.tool_offset[2];
      if (block.event.kind == QueueEvent::Kind::kWaitInput) queue_.answer({});
    }
    return end;
  }
  void drop_everything() {
    queue_.drop_all();
    for (int i = 0; i < 100'000 && (queue_.buffered_s() > 0 || queue_.holds_stop()); ++i) {
      queue_.look();
      queue_.front();
    }
  }

  std::string path_ = fmt::format("{}planner_thread_{}.ngc", ::testing::TempDir(), getpid());
  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  MotionQueue queue_{4096};
  PlannerThread planner_{assembly_, queue_, Parameters(), ToolTable::parse("T1 P1 Z+50\n", "t")};
  JointVec q_ = standing_joints(assembly_);
};

TEST_F(Planner, KeepsTheQueueAsFullAsTheConfigSays) {
  planner_.load(program(zigzag(400)), q_);
  EXPECT_GE(queue_.buffered_s(), assembly_.planner.buffer_s) << "when load is back";
  const Words end = end_of_motion();
  EXPECT_NEAR(end[kX], zigzag_x(399), 1e-9) << "all of it, as fast as it is taken";
  EXPECT_NEAR(end[kY], 0.5, 1e-9);
  EXPECT_EQ(planner_.take_failure(), "");
}

// What the tick has not let go is a part of the last program; behind it a new one would begin in the wrong
// place.
TEST_F(Planner, ANewProgramWaitsForTheTickToLetTheLastOneGo) {
  planner_.load(program(zigzag(2000)), q_);
  planner_.settle();
  queue_.look();
  while (queue_.buffered_s() > 0.5) take();
  ASSERT_GT(queue_.buffered_s(), 0);
  ASSERT_FALSE(queue_.holds_stop());
  try {
    planner_.load(path_, q_);
    FAIL() << "something of the last program is left";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the tick does not let the last program go");
  }
  drop_everything();
  planner_.load(path_, q_);
  EXPECT_GT(queue_.buffered_s(), 0);
}

// The machine stands at X10 all the time.
TEST_F(Planner, AnMdiLineGoesOnInTheModesOfTheOneBefore) {
  q_[0] = 10;
  const auto x_after = [&](const std::string& text) {
    planner_.load_mdi(text, q_);
    return end_of_motion()[kX];
  };
  EXPECT_NEAR(x_after("G21 G90 G0 X3"), 3, 1e-9);
  EXPECT_NEAR(x_after("G91 G0 X5"), 15, 1e-9);
  EXPECT_NEAR(x_after("G0 X7"), 17, 1e-9) << "G91 still holds";
  EXPECT_NEAR(x_after("G90 G0 X4"), 4, 1e-9);
  EXPECT_NEAR(x_after("G0 X6"), 6, 1e-9);
}

TEST_F(Planner, AProgramEndsWhatMdiLinesHandOn) {
  q_[0] = 10;
  planner_.load_mdi("G21 G91 G0 X5", q_);
  EXPECT_NEAR(end_of_motion()[kX], 15, 1e-9);
  planner_.load(program("G0 X7\nM2\n"), q_);
  EXPECT_NEAR(end_of_motion()[kX], 7, 1e-9) << "G90 of the config";
  planner_.load_mdi("G0 X9", q_);
  EXPECT_NEAR(end_of_motion()[kX], 9, 1e-9);
}

// What stands behind a question to the machine cannot be checked before: the blocks up to it come, and the
// end.
TEST_F(Planner, AMistakeThatComesLateIsToldOnce) {
  const std::string remark = planner_.load(program("G21 G90 G0 X5\nM66 P0 L0\nG0 X[1\nM2\n"), q_);
  EXPECT_NE(remark.find("checked up to line 2"), std::string::npos) << remark;
  EXPECT_EQ(planner_.take_failure(), "") << "not reached yet";
  EXPECT_NEAR(end_of_motion()[kX], 5, 1e-9);
  planner_.settle();
  const std::string failure = planner_.take_failure();
  EXPECT_NE(failure.find(path_ + ":3:"), std::string::npos) << failure;
  EXPECT_EQ(planner_.take_failure(), "") << "once";
}

// The operator may be quicker than the planner, which has yet to come to the change.
TEST_F(Planner, AToolMayBeConfirmedBeforeTheProgramWaitsForIt) {
  std::string text = zigzag(400);
  text.insert(text.size() - 3, "T1 M6\nG0 X5\n");
  planner_.load(program(text), q_);
  planner_.starts();
  auto confirmed = std::async(std::launch::async, [&] { planner_.confirm_tool(1); });
  while (take().event.kind != QueueEvent::Kind::kToolChange) continue;
  EXPECT_NO_THROW(confirmed.get());
  queue_.answer({});
  EXPECT_NEAR(end_of_motion()[kX], 5, 1e-9);
  EXPECT_EQ(planner_.take_failure(), "");
}

// Behind a program stop nothing is read before the tick has passed it.
TEST_F(Planner, BlockDeleteSwitchedAtAStopActsOnTheNextLine) {
  for (const std::string stop : {"M0", "M1"}) {
    SCOPED_TRACE(stop);
    planner_.set_switches({0, false, true});
    planner_.load(program("G21 G90 G0 X5\n" + stop + "\n/G0 X9\nG0 X7\nM2\n"), q_);
    const ReadingPlace place = planner_.switch_block_delete(true);
    EXPECT_EQ(place.line, 2U);
    EXPECT_EQ(place.block, 2U);
    std::vector<double> ends;
    for (MotionBlock block = take(); block.event.kind != QueueEvent::Kind::kProgramEnd; block = take())
      if (block.segment_count > 0) ends.push_back(block.piece.at(block.piece.length)[kX]);
    EXPECT_NEAR(ends.back(), 7, 1e-9);
    for (const double x : ends) EXPECT_LT(x, 8);
    EXPECT_TRUE(planner_.switches().block_delete) << "the next program begins so";
    EXPECT_EQ(planner_.switch_block_delete(false).line, 0U) << "no program is read any more";
  }
}

TEST_F(Planner, ALineThatWouldLeaveTheMachineKeepsBlockDeleteAsItIs) {
  planner_.set_switches({0, true, true});
  planner_.load(program("G21 G90 G0 X5\nM0\n/G0 X9000\nG0 X7\nM2\n"), q_);
  try {
    planner_.switch_block_delete(false);
    FAIL() << "X9000 is far away";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(path_ + ":3:"), std::string::npos) << error.what();
  }
  EXPECT_NEAR(end_of_motion()[kX], 7, 1e-9);
}

// As the operator touches off and measures at a stop; the path from there on is that of the new offset.
TEST_F(Planner, OffsetsAndLengthsSetAtAStopCountBehindIt) {
  planner_.load(program("G21 G90 M61 Q1 G43 G0 X5 Z10\nM0\nG0 X7 Z1\nM2\n"), q_);
  JointVec stands = q_;
  stands[0] = 25;
  const HeldLines lines = planner_.obey_held("G10 L20 P0 X20\nG10 L1 P1 Z60\n", stands);
  EXPECT_EQ(lines.after_block, 2U);
  EXPECT_NEAR(lines.stands[0], 25, 1e-9);
  try {
    planner_.obey_held("G10 L2 P1 X9000", q_);
    FAIL() << "the next line would leave the machine";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(path_ + ":3:"), std::string::npos) << error.what();
  }
  double length = 0;
  const Words end = end_of_motion(&length);
  EXPECT_NEAR(end[kX], 12, 1e-9);
  EXPECT_NEAR(end[kZ], 1, 1e-9);
  EXPECT_EQ(length, 60) << "words are those of the tip";
  EXPECT_EQ(planner_.take_failure(), "");
}

TEST_F(Planner, InMotionNothingIsSetInTheProgram) {
  planner_.load(program(zigzag(400)), q_);
  EXPECT_THROW(planner_.obey_held("G10 L2 P1 X1", q_), std::runtime_error);
  end_of_motion();
}

// Behind an answer the planner reads on, and what the operator sets then would change it in the middle of
// that.
TEST_F(Planner, BehindAnAnswerNothingIsSetInTheProgram) {
  planner_.load(program("G21 G90 G0 X5\nM66 P0 L0\n" + zigzag(400)), q_);
  while (take().event.kind != QueueEvent::Kind::kWaitInput) continue;
  queue_.answer({});
  take();  // what is read behind it
  EXPECT_THROW(planner_.obey_held("G10 L2 P1 X1", q_), std::runtime_error);
  end_of_motion();
  EXPECT_EQ(planner_.take_failure(), "");
}

// Nobody stands at an M1 that does not stop: there the program is read on.
TEST_F(Planner, AtAnOptionalStopThatIsOffItReadsOn) {
  planner_.set_switches({0, false, false});
  planner_.load(program("G21 G90 G0 X5\nM1\n" + zigzag(400)), q_);
  EXPECT_GE(queue_.buffered_s(), assembly_.planner.buffer_s);
  EXPECT_GT(planner_.switch_block_delete(true).line, 2U);
  end_of_motion();
}

TEST_F(Planner, WhereNoProgramWaitsNoToolIsConfirmed) {
  planner_.load(program("G0 X5\nM2\n"), q_);
  planner_.abandon();
  EXPECT_THROW(planner_.confirm_tool(1), std::runtime_error);
}

TEST_F(Planner, AMistakeAtTheBeginningRefusesTheProgram) {
  EXPECT_THROW(planner_.load(program("G1 F100 X[1\nM2\n"), q_), std::runtime_error);
  EXPECT_THROW(planner_.load(path_ + ".none", q_), std::runtime_error);
}

TEST_F(Planner, ClosedItPreparesNothingMore) {
  planner_.close();
  try {
    planner_.load(program(zigzag(10)), q_);
  } catch (const std::exception&) {  // either is right: nothing may come
  }
  queue_.look();
  EXPECT_EQ(queue_.front(), nullptr);
  EXPECT_EQ(queue_.buffered_s(), 0);
}

}  // namespace
}  // namespace trn
