#include "app/session/dry_run.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "kernel/joint_map.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// What the planner makes of a program, on the shipped cradle with its tools.
struct Planned {
  std::vector<MotionBlock> moves;
  std::vector<QueueEvent::Kind> events;
  std::vector<JointVec> ends;  ///< of the moves
  double time_s = 0;
};

class DryRunTest : public testing::Test {
 protected:
  DryRunTest() { assembly_.program.tool_confirm = ToolConfirm::kNobody; }

  Planned plan(const std::string& text, bool dry, const JointVec& q = JointVec::Zero(5)) {
    Parameters parameters;
    ToolTable tools = ToolTable::load(source_dir() + "/examples/tools.tbl");
    ProgramStart start{"dry", text, q};
    start.switches.dry_run = dry;
    Pipeline pipeline(assembly_, parameters, tools, start, {});
    Planned out;
    for (MotionBlock block; pipeline.next(block);) {
      if (block.segment_count == 0) {
        out.events.push_back(block.event.kind);
        continue;
      }
      JointVec q_begin, q_end;
      EXPECT_EQ(assembly_.map->map(block.piece.at(block.segments[0].s), block.context, q_begin),
                KinStatus::kOk);
      const TimeSegment& last = block.segments[static_cast<std::size_t>(block.segment_count - 1)];
      EXPECT_EQ(assembly_.map->map(block.piece.at(last.s_at(last.duration_s)), block.context, q_end),
                KinStatus::kOk);
      const JointVec& before = out.ends.empty() ? q : out.ends.back();
      EXPECT_LT((q_begin - before).lpNorm<Eigen::Infinity>(), 1e-6) << "a jump at line " << block.source.line;
      out.ends.push_back(q_end);
      out.moves.push_back(block);
      for (int i = 0; i < block.segment_count; ++i)
        out.time_s += block.segments[static_cast<std::size_t>(i)].duration_s;
    }
    return out;
  }
  static bool has(const Planned& planned, QueueEvent::Kind kind) {
    return std::find(planned.events.begin(), planned.events.end(), kind) != planned.events.end();
  }

  Assembly assembly_ = assemble(source_dir() + "/configs/cradle.toml");
};

constexpr char kPart[] =
    "G21 G90 G61.1\nS3000 M3 M8\nG0 X10 Z-50\nG1 Z-100 F60\nX60\nG2 X80 Y20 I0 J20\nM0\nG0 Z-50\n";

// The end of an axis' range belongs to it: there the tool is drawn back as anywhere.
TEST_F(DryRunTest, DrawsBackAtTheEndsOfOtherAxesToo) {
  const JointLimit& x = assembly_.plan_joints[0].limit;
  for (const double end : {x.min, x.max}) {
    const Planned dry = plan(fmt::format("G21 G90 G61.1\nG0 X{} Z-100\n", end), true);
    ASSERT_FALSE(dry.ends.empty());
    EXPECT_EQ(dry.ends.back()[0], end);
    EXPECT_NEAR(dry.ends.back()[2], -100 + assembly_.program.dry_run_up_mm, 1e-9) << end;
  }
}

TEST_F(DryRunTest, StaysAwayGoesFastAndTurnsNothing) {
  const Planned real = plan(kPart, false), dry = plan(kPart, true);
  ASSERT_FALSE(dry.ends.empty());
  double lowest = 0, lowest_dry = 0;
  for (const JointVec& q : real.ends) lowest = std::min(lowest, q[2]);
  for (const JointVec& q : dry.ends) lowest_dry = std::min(lowest_dry, q[2]);
  EXPECT_NEAR(lowest, -100, 1e-9);
  EXPECT_NEAR(lowest_dry, -100 + assembly_.program.dry_run_up_mm, 1e-9);
  EXPECT_NEAR((dry.ends.back() - real.ends.back())[0], 0, 1e-9);
  EXPECT_GT(real.time_s, 100) << "F60";
  EXPECT_LT(dry.time_s, 5);
  EXPECT_TRUE(has(real, QueueEvent::Kind::kSpindle) && has(real, QueueEvent::Kind::kCoolant));
  EXPECT_FALSE(has(dry, QueueEvent::Kind::kSpindle) || has(dry, QueueEvent::Kind::kCoolant));
  EXPECT_TRUE(has(dry, QueueEvent::Kind::kProgramStop)) << "it still stops where the program stops";
}

// G53 Z at the top of the range is in many programs.
TEST_F(DryRunTest, StaysInsideTheJointsRanges) {
  const double top = assembly_.plan_joints[2].limit.max;
  const Planned dry = plan(
      "G21 G90\nG53 G0 Z" + std::to_string(top - 5) + "\nG53 G0 Z" + std::to_string(top) + "\nG1 X10 F100\n",
      true);
  ASSERT_FALSE(dry.ends.empty());
  for (const JointVec& q : dry.ends) EXPECT_LE(q[2], top);
  EXPECT_NEAR(dry.ends.back()[2], top, 1e-3);
  const Planned below = plan("G21 G90\nG53 G0 Z" + std::to_string(top - 5) + "\n", true);
  ASSERT_FALSE(below.ends.empty());
  EXPECT_NEAR(below.ends.back()[2], top, 1e-3) << "5 mm of 20 are left to draw back";
}

TEST_F(DryRunTest, DrawsTheToolBackAlongItsOwnAxis) {
  const std::string text = "G21 G90 T1 M6\nG43.4 H1\nG0 X10 Y5 Z60 A-30 C40\nG1 X20 A-20 F500\nG49\nG0 X0\n";
  const Planned real = plan(text, false), dry = plan(text, true);
  // Where both stand with RTCP, the tips differ by the way back along the axis.
  const auto tilted = [](const Planned& planned) {
    for (std::size_t i = 0; i + 1 < planned.moves.size(); ++i)
      if (planned.moves[i].context.rtcp && !planned.moves[i + 1].context.rtcp) return i;
    return std::size_t{0};
  };
  const std::size_t a = tilted(real), b = tilted(dry);
  ASSERT_TRUE(real.moves[a].context.rtcp && dry.moves[b].context.rtcp);
  ToolPose at, away;
  ASSERT_EQ(tool_pose(*assembly_.map, real.ends[a], real.moves[a].context, at), KinStatus::kOk);
  ASSERT_EQ(tool_pose(*assembly_.map, dry.ends[b], dry.moves[b].context, away), KinStatus::kOk);
  EXPECT_LT((away.p_B - at.p_B - assembly_.program.dry_run_up_mm * at.u_B).norm(), 1e-6);
  EXPECT_LT((away.u_B - at.u_B).norm(), 1e-9);
}

TEST_F(DryRunTest, RefusesToProbe) {
  try {
    assembly_.program.io = true;
    plan("G21 G90\nG38.2 Z-10 F100\n", true);
    FAIL() << "it was taken";
  } catch (const ProgramError& error) {
    EXPECT_NE(std::string(error.what()).find("a dry run has nothing to probe"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace trn
