#include "app/daemon/program_process.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/motion.h"
#include "core/sanitizer.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/motion_queue.h"
#include "tests/support/paths.h"
#include "tests/support/rounds.h"

// The process that plans programs, before a queue whose tick is played by the test.
namespace trn {
namespace {

using Clock = std::chrono::steady_clock;

std::string written(const std::string& name, const std::string& text) {
  std::string path = testing::TempDir() + "/" + name;
  std::ofstream(path) << text;
  return path;
}

// With this line in the section of the planner.
std::string mill_with(const std::string& line) {
  std::string text = read_text_file(source_dir() + "/configs/mill.toml");
  const std::string section = "[planner]\n";
  return text.insert(text.find(section) + section.size(), line);
}

/// Looks until it is so, and rests between two looks: the process that is waited for needs the processor,
/// too. False after some minutes, which no busy computer needs.
template <typename Condition>
bool comes_to_pass(Condition&& so) {
  for (const auto end = Clock::now() + std::chrono::minutes(5); !so();) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// Hundreds of blocks without a stop between them.
std::string zigzag(int lines) {
  std::string text = "G21 G90 G94 G64 P0.01\nG1 F600\n";
  for (int i = 0; i < lines; ++i) text += fmt::format("X{:.1f} Y{:.1f}\n", 0.5 * (i % 200), 0.5 * (i % 2));
  return text + "M2\n";
}

class ProgramProcessTest : public testing::Test {
 protected:
  explicit ProgramProcessTest(const std::string& line = "", const MemoryFiles& files = {})
      : config_(parse_config(mill_with(line), "mill.toml")),
        process_(config_, files, 4096),
        assembly_(assemble(config_)),
        q_(standing_joints(assembly_)) {}

  MotionQueue& queue() { return process_.queue(); }
  /// The next block, as soon as it has come; false if the process has failed.
  bool take(MotionBlock& block) {
    const auto end = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < end) {
      queue().look();
      if (const MotionBlock* front = queue().front()) {
        block = *front;
        queue().pop();
        return true;
      }
      failure_ = process_.take_failure();
      if (!failure_.empty()) return false;
      std::this_thread::yield();
    }
    ADD_FAILURE() << "no block comes";
    return false;
  }
  std::vector<MotionBlock> take_all() {
    std::vector<MotionBlock> blocks(1);
    while (take(blocks.back()) && blocks.back().event.kind != QueueEvent::Kind::kProgramEnd)
      blocks.emplace_back();
    return blocks;
  }
  /// Unless it was heard while the blocks were taken.
  void hear_failure() {
    comes_to_pass([&] {
      if (failure_.empty()) failure_ = process_.take_failure();
      return !failure_.empty();
    });
  }
  void drop_everything() {
    queue().drop_all();
    for (int i = 0; i < 100'000 && (queue().buffered_s() > 0 || queue().holds_stop()); ++i) {
      queue().look();
      queue().front();
    }
    ASSERT_EQ(queue().buffered_s(), 0);
    ASSERT_FALSE(queue().holds_stop());
  }
  /// What the same program gives in one process.
  std::vector<MotionBlock> planned_here(const std::string& path) {
    Parameters parameters;
    ToolTable tools;
    Pipeline pipeline(assembly_, parameters, tools, {path, std::nullopt, q_}, {});
    std::vector<MotionBlock> blocks;
    for (MotionBlock block; pipeline.next(block);) blocks.push_back(block);
    return blocks;
  }
  static void expect_same(const std::vector<MotionBlock>& a, const std::vector<MotionBlock>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      ASSERT_EQ(a[i].segment_count, b[i].segment_count) << i;
      ASSERT_EQ(a[i].source.line, b[i].source.line) << i;
      for (int k = 0; k < a[i].segment_count; ++k)
        ASSERT_EQ(std::memcmp(&a[i].segments[static_cast<std::size_t>(k)],
                              &b[i].segments[static_cast<std::size_t>(k)], sizeof a[i].segments[0]),
                  0)
            << i << " " << k;
    }
  }

  ConfigTable config_;
  ProgramProcess process_;
  Assembly assembly_;
  JointVec q_;
  std::string failure_;
};

/// The process that makes those that plan: the only child of this one.
pid_t maker_of_workers() {
  pid_t maker = 0;
  std::ifstream(fmt::format("/proc/self/task/{}/children", getpid())) >> maker;
  return maker;
}

void expect_no_more_programs(ProgramProcess& process, const std::string& path, const JointVec& q) {
  for (int i = 0; i < 3; ++i) {
    try {
      process.load(path, q);
      ADD_FAILURE() << "loaded";
    } catch (const ProgramError& error) {
      EXPECT_NE(std::string(error.what()).find("restart the daemon"), std::string::npos) << error.what();
    }
  }
}

// Nobody makes another then; the rest of the daemon goes on, and says so.
TEST_F(ProgramProcessTest, TheMakersEndIsTold) {
  const std::string path = written("maker.ngc", zigzag(5000));
  process_.load(path, q_);
  MotionBlock block;
  ASSERT_TRUE(take(block));
  ASSERT_GT(maker_of_workers(), 0);
  kill(maker_of_workers(), SIGKILL);
  while (take(block)) continue;
  EXPECT_NE(failure_.find("restart the daemon"), std::string::npos) << failure_;
  EXPECT_TRUE(process_.lost());
  EXPECT_EQ(process_.worker(), 0);
  expect_no_more_programs(process_, path, q_);
}

TEST_F(ProgramProcessTest, TheMakersEndEndsALoad) {
  const std::string path = written("endless.ngc", "G21\no1 while [1 EQ 1]\nG4 P0\no1 endwhile\nM2\n");
  process_.load(written("short.ngc", zigzag(3)), q_);
  const pid_t maker = maker_of_workers();
  std::thread killer([maker] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    kill(maker, SIGKILL);
  });
  const auto begin = Clock::now();
  try {
    process_.load(path, q_);
  } catch (const ProgramError& error) {
    EXPECT_NE(std::string(error.what()).find("restart the daemon"), std::string::npos) << error.what();
  }
  killer.join();
  EXPECT_LT(Clock::now() - begin, std::chrono::seconds(20));
  expect_no_more_programs(process_, path, q_);
}

TEST_F(ProgramProcessTest, BlocksAreThoseOfOneProcess) {
  const std::string path = written("zigzag.ngc", zigzag(500));
  process_.load(path, q_);
  EXPECT_NE(process_.worker(), 0);
  EXPECT_NE(process_.worker(), getpid());
  expect_same(take_all(), planned_here(path));
}

TEST_F(ProgramProcessTest, WhatIsWrongWithAProgramIsToldAsBefore) {
  try {
    process_.load(written("bad.ngc", "G21\nG1 X[1+ F100\nM2\n"), q_);
    FAIL() << "it was taken";
  } catch (const ProgramError& error) {
    EXPECT_NE(std::string(error.what()).find("bad.ngc:2:"), std::string::npos) << error.what();
  }
  const pid_t worker = process_.worker();
  process_.load_mdi("G0 X1", q_);
  EXPECT_EQ(process_.worker(), worker) << "an error of the program is none of the process";
}

TEST_F(ProgramProcessTest, WhatTheProgramSaysIsHeardInOrder) {
  process_.load(written("says.ngc", "(MSG, turn the part)\n#1=2\nG0 X1\n(DEBUG, #1 holes)\nM2\n"), q_);
  take_all();
  std::vector<ProgramMessage> said;
  comes_to_pass([&] {
    EXPECT_EQ(process_.take_failure(), "");
    for (ProgramMessage& message : process_.take_messages()) said.push_back(message);
    return said.size() >= 2;
  });
  ASSERT_EQ(said.size(), 2u);
  EXPECT_EQ(said[0].line, 1u);
  EXPECT_NE(said[0].text.find("turn the part"), std::string::npos) << said[0].text;
  EXPECT_EQ(said[1].line, 4u);
  EXPECT_NE(said[1].text.find("2"), std::string::npos) << said[1].text;
}

TEST_F(ProgramProcessTest, HowLongAProgramTakesIsKnownBeforeItRuns) {
  const int strokes = test::brief(3000);
  const std::string path = written("long.ngc", zigzag(strokes));
  process_.load(path, q_);
  ProgramTime time;
  ASSERT_TRUE(comes_to_pass([&] {
    EXPECT_EQ(process_.take_failure(), "");
    return process_.take_program_time(time);
  }));
  ASSERT_TRUE(time.known);
  EXPECT_FALSE(time.about);
  double real_s = 0;
  for (const MotionBlock& block : planned_here(path))
    for (int i = 0; i < block.segment_count; ++i)
      real_s += block.segments[static_cast<std::size_t>(i)].duration_s;
  EXPECT_GT(real_s, strokes / 30.0);
  EXPECT_NEAR(time.time.total_s(), real_s, 1e-6);
  EXPECT_FALSE(process_.take_program_time(time)) << "told once";
  process_.abandon();
  drop_everything();
  process_.load(written("short.ngc", zigzag(3)), q_);
  EXPECT_TRUE(comes_to_pass([&] {
    EXPECT_EQ(process_.take_failure(), "");
    return process_.take_program_time(time);
  }));
  EXPECT_LT(time.time.total_s(), 1) << "of the program that was loaded last";
}

TEST_F(ProgramProcessTest, WhatEachBlockIsForComesOverBeforeIt) {
  std::string text = "G21 G90 F600\n";
  for (int i = 1; i <= 300; ++i) text += fmt::format("G1 X{} (hole {})\n", i, i);
  process_.load(written("holes.ngc", text + "M2\n"), q_);
  int moves = 0;
  for (MotionBlock block; take(block) && block.event.kind != QueueEvent::Kind::kProgramEnd;) {
    const ProgramStep* step = process_.step(block.source.step);
    ASSERT_NE(step, nullptr) << block.source.step;
    EXPECT_EQ(step->source.line, block.source.line);
    if (!step->moves) continue;
    const int hole = static_cast<int>(block.source.line) - 1;
    EXPECT_EQ(std::string(step->text.data()), fmt::format("G1 X{} (hole {})", hole, hole));
    EXPECT_NEAR(step->frame.mm_of(step->to)[kX], hole, 1e-9);
    ++moves;
  }
  EXPECT_GE(moves, 300);
  EXPECT_EQ(process_.step(1'000'000)->source.line, 302u) << "the last that there was";
}

TEST_F(ProgramProcessTest, BetweenProgramsItIsKnownHowTheNextOneBegins) {
  EXPECT_EQ(process_.step(0), nullptr);
  process_.show();
  const auto stands = [&](const std::function<bool(const ProgramStep&)>& wanted) {
    return comes_to_pass([&] {
      const ProgramStep* step = process_.step(0);
      return step && wanted(*step);
    });
  };
  EXPECT_TRUE(stands([](const ProgramStep& step) { return !step.settings.modal.inch; }));
  process_.load_mdi("G20 G10 L2 P2 X1 Y0.5\nG55", q_);
  take_all();
  EXPECT_TRUE(stands([](const ProgramStep& step) { return step.settings.modal.inch; }));
  const ProgramStep& step = *process_.step(0);
  EXPECT_EQ(step.settings.modal.work_offset, 2);
  // The offsets are in force: what lies at 25.4, 12.7 mm is the program's zero.
  Words place = Words::Zero();
  place.head<2>() << 25.4, 12.7;
  EXPECT_NEAR(step.frame.mm_of(place).xyz.norm(), 0, 1e-9);
}

// At random moments of planning, loading and resting. Nothing is left of the old program, and the next one is
// whole.
TEST_F(ProgramProcessTest, OneThatIsKilledIsANamedFailureAndTheNextOneWorks) {
  const int kills = test::rounds(20);
  const std::string path = written("zigzag.ngc", zigzag(3000));
  const std::vector<MotionBlock> whole = planned_here(path);
  std::mt19937 rng(7);
  int while_planning = 0;
  for (int i = 0; i < kills; ++i) {
    process_.load(path, q_);
    const int taken = std::uniform_int_distribution<int>(0, static_cast<int>(whole.size()) - 1)(rng);
    MotionBlock block;
    for (int k = 0; k < taken; ++k) ASSERT_TRUE(take(block));
    kill(process_.worker(), SIGKILL);
    const std::vector<MotionBlock> rest = take_all();
    const bool ended = rest.back().event.kind == QueueEvent::Kind::kProgramEnd;
    hear_failure();
    EXPECT_NE(failure_.find("was killed"), std::string::npos) << failure_;
    EXPECT_TRUE(process_.lost());
    EXPECT_FALSE(process_.lost()) << "said once";
    while_planning += !ended;
    process_.abandon();
    drop_everything();
    failure_.clear();
  }
  EXPECT_GT(while_planning, kills / 4) << "too few of the kills came while it planned";
  process_.load(path, q_);
  expect_same(take_all(), whole);
}

// A sanitizer takes some signals itself, and ends the process with a report.
TEST_F(ProgramProcessTest, ADefectIsNamedByItsSignal) {
  std::vector<int> signals = {SIGABRT, SIGSYS};
  if (!kSanitized) signals.insert(signals.end(), {SIGSEGV, SIGBUS, SIGFPE, SIGILL});
  for (const int signal : signals) {
    process_.load_mdi("G0 X1", q_);
    kill(process_.worker(), signal);
    failure_.clear();
    hear_failure();
    EXPECT_NE(failure_.find("signal " + std::to_string(signal)), std::string::npos) << failure_;
    process_.abandon();
    drop_everything();
  }
}

// It does not even hear that it shall give up: it is ended, and who asks next does not notice.
TEST_F(ProgramProcessTest, OneThatHangsIsReplaced) {
  process_.load(written("zigzag.ngc", zigzag(3000)), q_);
  const pid_t hangs = process_.worker();
  kill(hangs, SIGSTOP);
  process_.abandon();
  drop_everything();
  const auto before = Clock::now();
  process_.load_mdi("G0 X1", q_);
  EXPECT_LT(Clock::now() - before, std::chrono::seconds(30));
  EXPECT_NE(process_.worker(), hangs);
}

// The call itself is given up by another thread, as a stop does.
TEST_F(ProgramProcessTest, ACallThatHangsCanBeGivenUp) {
  process_.load_mdi("G0 X1", q_);
  drop_everything();
  kill(process_.worker(), SIGSTOP);
  std::thread stop([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    process_.abandon();
  });
  EXPECT_THROW(process_.load_mdi("G0 X2", q_), ProgramError);
  stop.join();
}

class SmallProgramProcess : public ProgramProcessTest {
 protected:
  SmallProgramProcess() : ProgramProcessTest("memory_mb = 64\n") {}
};

TEST_F(SmallProgramProcess, AProgramThatNeedsTooMuchMemoryIsRefused) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's own memory has no limit";
  std::string text = "G21\n";
  for (int i = 0; i < 900'000; ++i) text += fmt::format("#<_a_name_of_some_length_{}>=1\n", i);
  try {
    process_.load(written("large.ngc", text + "M2\n"), q_);
    FAIL() << "it was taken";
  } catch (const ProgramError& error) {
    EXPECT_NE(std::string(error.what()).find("memory_mb"), std::string::npos) << error.what();
  }
  process_.load(written("zigzag.ngc", zigzag(50)), q_);
  EXPECT_EQ(take_all().back().event.kind, QueueEvent::Kind::kProgramEnd);
}

// The page shows offsets and tools as the planner has them, each time they change and no more often.
TEST_F(ProgramProcessTest, TablesComeOverWhenALineChangesThem) {
  trunnion::tables_t tables{};
  const auto newest = [&] { return comes_to_pass([&] { return process_.take_tables(tables); }); };
  process_.load_mdi("G10 L2 P2 Y-7.5", q_);
  take_all();
  ASSERT_TRUE(newest());
  comes_to_pass([&] {
    process_.take_tables(tables);
    return tables.offset_y[1] == -7.5;
  });
  EXPECT_EQ(tables.offset_name[1], "G55");
  EXPECT_EQ(tables.offset_y[1], -7.5);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(process_.take_tables(tables)) << "nothing has changed since";
}

class KeepingProgramProcess : public ProgramProcessTest {
 protected:
  KeepingProgramProcess() : ProgramProcessTest("", {testing::TempDir() + "/kept.var", ""}) {}
};

// What a line has set is on the disk before the call is answered, so the next process has it.
TEST_F(KeepingProgramProcess, OffsetsOutliveTheProcess) {
  process_.load_mdi("G10 L2 P1 X12.5", q_);
  take_all();
  kill(process_.worker(), SIGKILL);
  hear_failure();
  process_.load_mdi("G0 X0", q_);
  double last_x = 0;
  for (const MotionBlock& block : take_all())
    if (block.segment_count > 0) last_x = block.piece.at(block.piece.length)[kX];
  EXPECT_NEAR(last_x, 12.5, 1e-9);
}

}  // namespace
}  // namespace trn
