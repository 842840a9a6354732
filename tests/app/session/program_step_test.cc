#include "app/session/program_step.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/units.h"
#include "interp/gcode/program_config.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// A move of the program as people read it: the end of a block that ends at rest.
struct Arrival {
  ProgramStep step;
  ShownPosition at;
};

class Steps : public testing::Test {
 protected:
  explicit Steps(const std::string& machine = "cradle")
      : assembly_(assemble(source_dir() + "/configs/" + machine + ".toml")) {
    assembly_.program.tool_confirm = ToolConfirm::kNobody;
  }

  /// By the joints alone (the machine could have been jogged there), or as the path has it: both must agree.
  std::vector<Arrival> arrivals(const std::string& program) {
    std::vector<Arrival> out;
    PipelineObservers observers;
    observers.steps = true;
    Pipeline pipeline(assembly_, parameters_, tools_, {"p.ngc", program, standing_joints(assembly_)},
                      observers);
    std::optional<ProgramStep> step;
    for (MotionBlock block; pipeline.next(block);) {
      if (pipeline.step()) step = *pipeline.step();
      EXPECT_TRUE(step && step->source.step <= block.source.step);
      if (!step || block.segment_count == 0 || !block.ends_at_rest) continue;
      const Words y = block.piece.at(block.piece.length);
      JointVec q;
      EXPECT_EQ(assembly_.map->map(y, block.context, q), KinStatus::kOk);
      const ShownPosition at = shown_position(*assembly_.map, *step, q, true, y);
      // Off the path nobody knows words but those of the joints.
      const ShownPosition by_joints = shown_position(*assembly_.map, *step, q, false, Words::Constant(99));
      EXPECT_LT((at.work.xyz - by_joints.work.xyz).norm(), 1e-6) << step->text.data();
      EXPECT_LT((at.work.abc_deg - by_joints.work.abc_deg).norm(), 1e-6) << step->text.data();
      out.push_back({*step, at});
    }
    return out;
  }

  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_ = ToolTable::load(source_dir() + "/examples/tools.tbl");
};

// The machine stands where the program's own words say, whatever lies between them and the joints.
TEST_F(Steps, TheWorkPositionAtTheEndOfALineIsItsWords) {
  const std::string modes[] = {"G54",
                               "G10 L2 P2 X30 Y-20 Z5 R25\nG55",
                               "G92 X3 Y4 Z-5",
                               "T1 M6\nG43",
                               "G10 L2 P3 X1 Y2 Z3 A4 C5\nG56",
                               "T1 M6\nG43\nTRAORI",
                               "G10 L2 P2 X10 Y-20 Z5 R-40\nG55\nT1 M6\nG43\nTRAORI",
                               "G68.2 X10 Y5 Z2 I30 J20 K0\nG53.1"};
  for (const std::string& mode : modes) {
    parameters_ = Parameters();
    const std::vector<Arrival> found =
        arrivals("G61.1 G21 G90\nG0 Z120\n" + mode + "\nG0 X10 Y-5 Z80\nG1 X-3.5 Y7 Z70 F3000\nG0 X4 Y4\n");
    ASSERT_GE(found.size(), 3u) << mode;
    const Vec3 wanted[] = {{10, -5, 80}, {-3.5, 7, 70}, {4, 4, 70}};
    for (std::size_t i = 0; i < 3; ++i) {
      const Arrival& a = found[found.size() - 3 + i];
      EXPECT_LT((a.at.work.xyz - wanted[i]).norm(), 1e-6) << mode << ": " << a.step.text.data();
      EXPECT_LT(a.at.to_go.xyz.norm(), 1e-6) << mode;
    }
    EXPECT_EQ(std::string(found.back().step.text.data()), "G0 X4 Y4");
    EXPECT_TRUE(found.back().step.rapid);
    EXPECT_EQ(found.back().step.settings.motion, 0_g);
    EXPECT_EQ(found[found.size() - 2].step.settings.motion, 1_g) << "also while the line is under way";
  }
}

// G53 counts as the axes stand, without offset and tool.
TEST_F(Steps, TheMachinePositionIsThatOfG53) {
  const std::vector<Arrival> found = arrivals(
      "G61.1 G21 G90\nG10 L2 P2 X30 Y-20 Z5 R25\nG55\nT1 M6\nG43\nG0 Z100\nG53 G0 X12 Y-7 Z150\nG53 G0 X0 "
      "A-10\n");
  ASSERT_GE(found.size(), 2u);
  const MachineWords& there = found[found.size() - 2].at.machine;
  EXPECT_LT((there.xyz - Vec3(12, -7, 150)).norm(), 1e-6);
  EXPECT_NEAR(found.back().at.machine[kA], -10, 1e-6);
}

TEST_F(Steps, ALoopComesToItsLineInAStepOfItsOwnEachTime) {
  const std::vector<Arrival> found =
      arrivals("G61.1 G21 G90 F3000\n#1=0\no1 while [#1 LT 5]\n#1=[#1+1]\nG1 X#1\no1 endwhile\n");
  ASSERT_EQ(found.size(), 5u);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].step.source.line, 5u);
    EXPECT_EQ(std::string(found[i].step.text.data()), "G1 X#1");
    EXPECT_NEAR(found[i].at.work[kX], static_cast<double>(i + 1), 1e-9);
    EXPECT_TRUE(i == 0 || found[i].step.source.step > found[i - 1].step.source.step);
  }
}

// On curves that stand for many lines, too, where the machine is between two of them.
TEST_F(Steps, WhatIsLeftOfAMoveShrinksToNothing) {
  PipelineObservers observers;
  observers.steps = true;
  std::string text = "G21 G90 G64 P0.01 F3000\n";
  for (int i = 0; i < 400; ++i)
    text += fmt::format("G1 X{:.4f} Y{:.4f}\n", 30 * std::cos(i * 0.01), 30 * std::sin(i * 0.01));
  Pipeline pipeline(assembly_, parameters_, tools_, {"p.ngc", text, standing_joints(assembly_)}, observers);
  std::optional<ProgramStep> step;
  double worst = 0;
  for (MotionBlock block; pipeline.next(block);) {
    if (pipeline.step()) step = *pipeline.step();
    if (!step || block.segment_count == 0 || block.source.line <= 2) continue;
    const Words y = block.piece.at(block.piece.length);
    worst = std::max(
        worst, shown_position(*assembly_.map, *step, standing_joints(assembly_), true, y).to_go.xyz.norm());
  }
  EXPECT_LT(worst, 5) << "a piece of the curve stands for a few moves of 0.3 mm";
}

TEST_F(Steps, AnIdleMachineKnowsTheNextProgramsModes) {
  parameters_[parameter::kSystem] = 3;
  parameters_[parameter::kFirstOffset + 2 * parameter::kOffsetStride] = 12;
  const ProgramStep step = idle_step(assembly_, parameters_, tools_, nullptr);
  EXPECT_EQ(step.settings.modal.work_offset, 3);
  EXPECT_EQ(step.settings.g5x[kX], 12);
  EXPECT_FALSE(step.moves);
  const Words here = Words::Zero();
  EXPECT_EQ(step.frame.mm_of(here)[kX], -12);
}

}  // namespace
}  // namespace trn
