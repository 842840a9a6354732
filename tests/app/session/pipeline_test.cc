#include "app/session/pipeline.h"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <string>

#include "core/ports.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// Where every motion block ends, in joints, and what the program left behind.
struct Outcome {
  std::vector<JointVec> ends;
  Settings settings;
};

class Modes : public testing::Test {
 protected:
  Modes() { assembly_.program.tool_confirm = ToolConfirm::kNobody; }
  Outcome run(const std::vector<std::string>& lines, std::size_t from, std::size_t to, const JointVec& q,
              const std::optional<Settings>& kept) {
    std::string text;
    for (std::size_t i = from; i < to; ++i) text += lines[i] + "\n";
    ProgramStart start{"mdi", text, q};
    start.kept = kept;
    Pipeline pipeline(assembly_, parameters_, tools_, start, {});
    Outcome outcome;
    MotionBlock block;
    while (pipeline.next(block)) {
      if (block.segment_count == 0 || !block.ends_at_rest) continue;
      JointVec end;
      EXPECT_EQ(assembly_.map->map(block.piece.at(block.piece.length), block.context, end), KinStatus::kOk);
      outcome.ends.push_back(end);
    }
    outcome.settings = pipeline.settings();
    return outcome;
  }

  Assembly assembly_ = assemble(source_dir() + "/configs/cradle.toml");
  Parameters parameters_;
  ToolTable tools_ = ToolTable::load(source_dir() + "/examples/tools.tbl");
};

// However a sequence of lines is cut into two, the second part goes on as if it had not been cut.
TEST_F(Modes, PassFromOneMdiLineToTheNext) {
  const std::vector<std::string> lines = {
      "G61.1 G21 G90",
      "T1 M6",
      "S1000 M3 M8",
      "G0 X10 Y10 Z100",
      "G20 G91 F20",
      "G1 X0.5",
      "Y0.25",
      "G18 G2 X0.5 Z0 I0.25 K0",
      "G21 G90 G17",
      "G10 L2 P2 X5 Y6 Z7 R30",
      "G55",
      "G1 X20 Y5 F1500",
      "G92 X0 Y0",
      "G1 X1 Y2",
      "G92.1",
      "G54",
      "G0 X20 Y0 A-20 C30",
      "G43.4 H1",
      "G1 X22 A-25",
      "C45",
      "G49",
      "G68.2 X10 Y0 Z-20 I30 J15 K0",
      "G53.1",
      "G43.1 Z80",
      "G0 X3 Y4 Z30",
      "G1 Z20",
      "G69",
      "G93 G1 X5 F60",
      "X9 F30",
      "G94 G1 X8 F100",
  };
  const JointVec zero = JointVec::Zero(5);
  const Outcome whole = run(lines, 0, lines.size(), zero, std::nullopt);
  ASSERT_EQ(whole.ends.size(), 15U);
  for (std::size_t cut = 1; cut < lines.size(); ++cut) {
    parameters_ = {};
    const Outcome first = run(lines, 0, cut, zero, std::nullopt);
    const JointVec at = first.ends.empty() ? zero : first.ends.back();
    const Outcome second = run(lines, cut, lines.size(), at, first.settings);
    ASSERT_EQ(first.ends.size() + second.ends.size(), whole.ends.size()) << "cut before " << lines[cut];
    for (std::size_t i = 0; i < second.ends.size(); ++i)
      EXPECT_LT((second.ends[i] - whole.ends[first.ends.size() + i]).norm(), 1e-9)
          << "cut before " << lines[cut] << ", motion " << i;
  }
}

class Check : public testing::Test {
 protected:
  ProgramSummary check(const std::string& text) {
    const std::string path = testing::TempDir() + "p.ngc";
    std::ofstream(path) << text;
    const ProgramStart start{path, std::nullopt, JointVec::Zero(5)};
    return check_program(assembly_, Parameters(), ToolTable::parse("", "t"), start, {});
  }
  Assembly assembly_ = assemble(source_dir() + "/configs/cradle.toml");
};

TEST_F(Check, AProgramThatEndsNeedsNoRemark) {
  const ProgramSummary summary = check("G21 G90\nG0 X10\nG0 X20\nM2\n");
  EXPECT_EQ(summary.lines, 4U);
  EXPECT_EQ(summary.moves, 2U);
  EXPECT_EQ(remark_on(summary), "");
}

TEST_F(Check, HowFarItCameIsTold) {
  EXPECT_EQ(remark_on(check("G21 G90\nG0 X10\nG0 X0\nM99\n")),
            "M99 in line 4 begins the program again, for ever\n");
  const ProgramSummary endless = check("G21 G90\n#1=1\nO100 while [#1 GT 0]\n#1=1\nO100 endwhile\nM2\n");
  EXPECT_GT(endless.endless, 0U);
  EXPECT_EQ(remark_on(endless).find("checked the first"), 0U) << remark_on(endless);
}

class LinesMax : public testing::Test {
 protected:
  // How many motions come before nothing does, or "perhaps for ever".
  std::string outcome(const std::string& text, std::uint64_t lines_max) {
    Parameters parameters;
    ToolTable tools = ToolTable::parse("", "t");
    Pipeline pipeline(assembly_, parameters, tools, {"p.ngc", text, JointVec::Zero(5)}, {});
    MotionBlock block;
    int stops = 0;
    try {
      while (pipeline.next(block, nullptr, lines_max))
        stops += block.segment_count > 0 && block.ends_at_rest ? 1 : 0;
    } catch (const ProgramError& error) {
      const std::string told = error.what();
      return told.substr(0, told.find(", perhaps for ever"));
    }
    return std::to_string(stops);
  }
  Assembly assembly_ = assemble(source_dir() + "/configs/cradle.toml");
};

// The bound is that of the lines for one block, however many have been run for those before.
TEST_F(LinesMax, BoundsTheLinesWithoutMotionAndNotTheProgram) {
  std::string text = "G21 G90 G94 G61.1 F1000\n";
  for (int i = 1; i <= 300; ++i) text += "G1 X" + std::to_string(i % 2) + "\n";
  EXPECT_EQ(outcome(text + "M2\n", 20), "300");
  for (int i = 0; i < 30; ++i) text += "#1=" + std::to_string(i) + "\n";
  EXPECT_EQ(outcome(text + "M2\n", 40), "300");
  const std::string told = outcome(text + "M2\n", 20);
  EXPECT_NE(told.find("lines were run here without any motion"), std::string::npos) << told;
}

}  // namespace
}  // namespace trn
