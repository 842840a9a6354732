#include "app/session/change_journal.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/support/paths.h"

// A program that was read ahead, and given up in one of its blocks, leaves what it left where only the lines
// up to that block were read.
namespace trn {
namespace {

struct NoMoves : MoveSink {
  void move(const ProgramMove&) override {}
  void event(const QueueEvent&, SourceLine) override {}
};

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }

 private:
  std::mt19937_64 random_;
};

// Numbers below and above #30, names with and without underscore, offsets, tools, and moves or none between
// them.
std::string drawn_lines(Dice& dice, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const int n = dice.below(50), x = dice.below(90);
    switch (dice.below(13)) {
      case 0:
        text += fmt::format("#{}={}\n", 1 + dice.below(30), n);
        break;
      case 1:
        text += fmt::format("#{}=[#{}+1]\n", 100 + dice.below(3), 100 + dice.below(3));
        break;
      case 2:
        text += fmt::format("#<_count{}>={}\n", dice.below(3), n);
        break;
      case 3:
        text += fmt::format("#<mine{}>={}\n", dice.below(3), n);
        break;
      case 4:
        text += fmt::format("G10 L2 P{} X{}\n", 1 + dice.below(9), n);
        break;
      case 5:
        text += fmt::format("G10 L1 P{} Z{}\n", 1 + dice.below(4), n);
        break;
      case 6:
        text += dice.below(2) == 0 ? fmt::format("G92 Z{}\n", n) : "G92.1\n";
        break;
      case 7:
        text += fmt::format("o100 call [{}] [{}]\n", n, x);
        break;
      case 8:
        text += fmt::format("#101={} G1 X{} F3000\n", n, x);
        break;
      case 9:
        text += dice.below(2) == 0 ? "M8\n" : fmt::format("T{} M6\n", 1 + dice.below(2));
        break;
      default:
        text += fmt::format("G1 X{} Y{} F3000\n", x, n);
    }
  }
  return text;
}

std::string drawn_program(Dice& dice) {
  return "o100 sub\n" + fmt::format("#3=#1\n#<own>=#2\n#<_sum>=[#1+#2]\nG1 Y[#1] F3000\n#102=[#102+#2]\n") +
         "o100 endsub\nG21 G90 G64 P0.01\n#<_sum>=0 #100=1 #101=1 #102=1\n" + drawn_lines(dice, 12) +
         fmt::format("#31=0\no200 while [#31 LT {}]\n#31=[#31+1]\n", 2 + dice.below(9)) +
         drawn_lines(dice, 5) + "o200 endwhile\n" + drawn_lines(dice, 8) + "M2\n";
}

struct Tables {
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50\nT2 P2 Z+60\n", "tools");
};

// A name that is not known is the same as one that was never read.
std::string difference(Parameters& a, Parameters& b) {
  for (int n = 1; n <= parameter::kMax; ++n)
    if (std::as_const(a)[n] != std::as_const(b)[n])
      return fmt::format("#{} is {} and not {}", n, std::as_const(a)[n], std::as_const(b)[n]);
  for (const Parameters* of : {&a, &b})
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(of->names().size()); ++i) {
      const std::string name = of->names().name(i);
      const auto text = [&name](Parameters& p) {
        const std::int32_t id = p.names().intern(name);
        const double *global = p.global(id), *local = p.local(id);
        return fmt::format("{} {}", global ? fmt::to_string(*global) : "-",
                           local ? fmt::to_string(*local) : "-");
      };
      if (text(a) != text(b)) return fmt::format("#<{}> is {} and not {}", name, text(a), text(b));
    }
  return "";
}

class ReadAhead : public ::testing::TestWithParam<int> {
 protected:
  // The truth: the program read by itself, up to the block and no further.
  void read_up_to(std::uint64_t block, Tables& tables) const {
    NoMoves moves;
    ProgramReader reader(assembly_, tables.parameters, tables.tools, start_, moves);
    while (reader.interpreter().blocks() < block)
      if (!reader.step()) break;
    tables.parameters.leave_sub_programs();
  }

  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  ProgramStart start_{"part", "", standing_joints(assembly_)};
};

TEST_P(ReadAhead, IsTakenBackToAnyOfItsBlocks) {
  Dice dice(static_cast<std::uint64_t>(GetParam()));
  start_.text = drawn_program(dice);
  SCOPED_TRACE(*start_.text);
  for (int round = 0; round < 6; ++round) {
    Tables tables;
    ChangeJournal journal(tables.parameters, tables.tools);
    journal.begin();
    PipelineObservers observers;
    observers.journal = &journal;
    observers.steps = true;
    std::vector<std::uint64_t> blocks;
    {
      Pipeline pipeline(assembly_, tables.parameters, tables.tools, start_, observers);
      MotionBlock block;
      const int most = round == 0 ? 100'000 : dice.below(60);
      for (int i = 0; i < most; ++i) {
        const bool more = pipeline.next(block);
        if (more && pipeline.step() && pipeline.step()->block > 0) blocks.push_back(pipeline.step()->block);
        if (!more && !pipeline.waiting()) break;
        if (!pipeline.waiting()) continue;
        blocks.clear();  // all before has been driven
        pipeline.answer({});
      }
    }
    if (blocks.empty()) continue;
    const std::uint64_t stands =
        blocks[static_cast<std::size_t>(dice.below(static_cast<int>(blocks.size())))];
    journal.take_back_to(stands);
    Tables expected;
    read_up_to(stands, expected);
    EXPECT_EQ(difference(tables.parameters, expected.parameters), "") << "block " << stands;
    EXPECT_EQ(tables.tools.to_text(), expected.tools.to_text()) << "block " << stands;
    if (round != 0) continue;
    journal.take_back();
    Parameters none;
    EXPECT_EQ(difference(tables.parameters, none), "") << "all of it";
    EXPECT_EQ(tables.tools.to_text(), Tables().tools.to_text()) << "all of it";
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, ReadAhead, ::testing::Range(1, 41));

// Typed lines have been acknowledged before a stop can come: what they set without a motion is in force.
TEST(ChangeJournal, LeavesWhatWasSetBeforeTheFirstMotion) {
  struct Row {
    const char* lines;
    double g55_x, count;
  };
  for (const Row& row : {Row{"G10 L2 P2 X7", 7, 0},
                         {"G10 L2 P2 X7\n#100=1", 7, 1},
                         {"G10 L2 P2 X7\nG1 X9 F900", 7, 0},
                         {"#100=1 G1 X9 F900\nG10 L2 P2 X7", 0, 1},
                         {"M8\nG10 L2 P2 X7\n#100=1", 0, 0}}) {
    const Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
    Tables tables;
    ChangeJournal journal(tables.parameters, tables.tools);
    journal.begin();
    PipelineObservers observers;
    observers.journal = &journal;
    Pipeline pipeline(assembly, tables.parameters, tables.tools,
                      {"mdi", row.lines, standing_joints(assembly)}, observers);
    for (MotionBlock block; pipeline.next(block);) continue;
    journal.take_back_to(0);
    EXPECT_EQ(tables.parameters[5241], row.g55_x) << row.lines;
    EXPECT_EQ(tables.parameters[100], row.count) << row.lines;
  }
}

// A loop that calculates for long keeps no more than it changes.
TEST(ChangeJournal, KeepsNoMoreThanIsChanged) {
  Parameters parameters;
  ToolTable tools;
  ChangeJournal journal(parameters, tools);
  journal.begin();
  for (std::uint64_t line = 1; line <= 100'000; ++line) {
    parameters[100] += 1;
    journal.line_done(line, 0);
  }
  EXPECT_EQ(parameters.take_changes().size(), 1u);
}

// What the operator or the machine has set while all before was driven is no line's.
TEST(ChangeJournal, LeavesWhatTheOperatorHasSet) {
  Parameters parameters;
  ToolTable tools;
  ChangeJournal journal(parameters, tools);
  journal.begin();
  parameters[100] = 1;
  journal.line_done(1, 1);
  parameters[100] = 2;
  tools.at_or_new(7).diameter = 8;
  journal.adopt();
  parameters[100] = 3;
  tools.at_or_new(7).diameter = 9;
  journal.line_done(2, 2);
  journal.take_back_to(1);
  EXPECT_EQ(parameters[100], 2);
  EXPECT_EQ(tools.find(7)->diameter, 8);
  journal.take_back();
  EXPECT_EQ(parameters[100], 0);
  EXPECT_EQ(tools.find(7), nullptr);
}

}  // namespace
}  // namespace trn
