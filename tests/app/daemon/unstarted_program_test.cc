#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "app/daemon/planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/machine_memory.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/safe_file.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/motion_queue.h"
#include "tests/support/paths.h"

// A program is read ahead when it is loaded. What its lines set is in force, and on disk, when it has
// started.
namespace trn {
namespace {

constexpr int kG54X = 5221;

class UnstartedProgram : public ::testing::Test {
 protected:
  UnstartedProgram() {
    std::filesystem::create_directories(folder_);
    std::ofstream(vars_) << "100 1\n5221 7\n";
    std::ofstream(tools_) << "T1 P1 Z+50\n";
    std::ofstream(folder_ + "/meas.txt") << "yesterday\n";
    load_parameters(vars_, parameters_);
  }
  ~UnstartedProgram() override { std::filesystem::remove_all(folder_); }

  void load(const std::string& text) {
    std::ofstream(folder_ + "/part.ngc") << text;
    planner().load(folder_ + "/part.ngc", q_);
  }
  PlannerThread& planner() {
    if (!planner_)
      planner_ = std::make_unique<PlannerThread>(assembly_, queue_, parameters_, ToolTable::load(tools_, 1),
                                                 PlannerListeners{}, MemoryFiles{vars_, tools_, folder_});
    return *planner_;
  }
  double on_disk(int number) const {
    Parameters parameters;
    load_parameters(vars_, parameters);
    return parameters[number];
  }
  /// Where X ends, when the tick has taken all of the motion.
  double end_x() {
    double x = std::nan("");
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < until) {
      queue_.look();
      const MotionBlock* front = queue_.front();
      if (!front) {
        std::this_thread::yield();
        continue;
      }
      const MotionBlock block = *front;
      queue_.pop();
      if (block.segment_count > 0) x = block.piece.at(block.piece.length)[kX];
      if (block.event.kind == QueueEvent::Kind::kProgramEnd) return x;
    }
    ADD_FAILURE() << "no end";
    return x;
  }
  void drop_everything() {
    queue_.drop_all();
    for (int i = 0; i < 100'000 && (queue_.buffered_s() > 0 || queue_.holds_stop()); ++i) {
      queue_.look();
      queue_.front();
    }
  }
  std::string log_text() const { return read_text_file(folder_ + "/meas.txt"); }

  std::string folder_ = fmt::format("{}unstarted_{}", ::testing::TempDir(), getpid());
  std::string vars_ = folder_ + "/v.var", tools_ = folder_ + "/t.tbl";
  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  Parameters parameters_;
  MotionQueue queue_{4096};
  JointVec q_ = standing_joints(assembly_);
  std::unique_ptr<PlannerThread> planner_;
};

constexpr const char* kSets =
    "G21 G90\n(LOGOPEN,meas.txt)\n(LOG,today)\nG10 L2 P1 X[#5221+10]\nG10 L1 P1 Z55\n#100=[#100+1]\nG1 X0 "
    "F3000\nM2\n";

TEST_F(UnstartedProgram, SetsNothing) {
  for (int i = 0; i < 3; ++i) {
    load(kSets);
    EXPECT_EQ(on_disk(kG54X), 7);
    EXPECT_EQ(on_disk(100), 1);
    EXPECT_EQ(read_text_file(tools_), "T1 P1 Z+50\n");
    EXPECT_EQ(log_text(), "yesterday\n");
    drop_everything();
  }
  planner().load_mdi("G0 X8", q_);
  EXPECT_NEAR(end_x(), 15, 1e-9) << "from G54 as it was";
  planner().settle();
  EXPECT_EQ(on_disk(kG54X), 7);
  EXPECT_EQ(on_disk(100), 1);
}

// However often it is prepared, it runs once.
TEST_F(UnstartedProgram, RunsFromWhatWasBefore) {
  for (int i = 0; i < 3; ++i) {
    drop_everything();
    load(kSets);
  }
  planner().starts();
  EXPECT_NEAR(end_x(), 17, 1e-9);
  planner().settle();
  EXPECT_EQ(planner().take_failure(), "");
  EXPECT_EQ(on_disk(kG54X), 17);
  EXPECT_EQ(on_disk(100), 2);
  EXPECT_NE(read_text_file(tools_).find("Z+55"), std::string::npos);
  EXPECT_EQ(log_text(), "today\n");
  planner().load_mdi("G0 X8", q_);
  EXPECT_NEAR(end_x(), 25, 1e-9);
}

// Started while it is still read.
TEST_F(UnstartedProgram, IsKeptWhileItIsRead) {
  std::string text = "G21 G90\nG10 L2 P1 X20\n";
  for (int i = 0; i < 400; ++i) text += fmt::format("G1 X{} F600\n", i % 2);
  load(text + "(LOGOPEN,meas.txt)\n(LOG,end)\nG10 L2 P1 X30\nG1 X0\nM2\n");
  EXPECT_EQ(on_disk(kG54X), 7);
  planner().starts();
  planner().starts();
  EXPECT_NEAR(end_x(), 30, 1e-9);
  planner().settle();
  EXPECT_EQ(on_disk(kG54X), 30);
  EXPECT_EQ(log_text(), "end\n");
}

TEST_F(UnstartedProgram, ATypedLineStartsAtOnce) {
  planner().load_mdi("G10 L2 P1 X3", q_);
  planner().settle();
  EXPECT_EQ(on_disk(kG54X), 3);
}

}  // namespace
}  // namespace trn
