#include <algorithm>

#include "core/config.h"
#include "core/motion.h"
#include "interp/gcode/error.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "tests/interp/gcode/run_program.h"

// M6 in two halves, the tool in the spindle, and the section [tool_change].
namespace trn {
namespace {

using test::CanonText;
using test::MoveList;
using test::Session;

/// A program on a machine that is asked.
struct Asked {
  explicit Asked(const std::string& program, Session session_in = {}) : session(std::move(session_in)) {
    interpreter.open_text(program, "p.ngc");
  }
  /// Until it waits or ends.
  void go() {
    while (!interpreter.waiting() && interpreter.step()) {
    }
  }
  double tool() const { return std::as_const(session.parameters)[parameter::kTool]; }
  std::vector<QueueEvent> changes() const {
    std::vector<QueueEvent> out;
    std::copy_if(list.events.begin(), list.events.end(), std::back_inserter(out),
                 [](const QueueEvent& e) { return e.kind == QueueEvent::Kind::kToolChange; });
    return out;
  }

  Session session;
  MoveList list;
  Lowering lowering{session.config, session.kinematics.get(), list};
  Interpreter interpreter{{session.config, session.parameters, session.tools, nullptr, lowering, {}, true}};
};

TEST(ToolChange, TheRestOfTheBlockWaitsForTheTool) {
  Asked asked("G21 G90\nT2 M6 G43 G0 Z10\nG0 X[#5400] Y#5403\nM2\n");
  asked.go();
  ASSERT_TRUE(asked.interpreter.asks_for_tool());
  EXPECT_TRUE(asked.list.moves.empty()) << "nothing is planned with the length of a tool nobody has put in";
  ASSERT_EQ(asked.changes().size(), 1U);
  EXPECT_EQ(asked.changes()[0].argument, 2);
  EXPECT_EQ(asked.changes()[0].value, kToolByOperator);
  EXPECT_EQ(asked.tool(), 0) << "the old one is still in the spindle";
  asked.interpreter.answer({});
  EXPECT_EQ(asked.tool(), 2);
  asked.go();
  ASSERT_EQ(asked.list.moves.size(), 2U);
  EXPECT_EQ(asked.list.moves[0].context.tool_offset[2], 80.5) << "G43 without H: the tool that is in now";
  EXPECT_EQ(asked.list.moves[1].to[kX], 2);
  EXPECT_EQ(asked.list.moves[1].to[kY], 80.5);
}

TEST(ToolChange, ATapeOfToolsAsksForEachOnce) {
  Asked asked("T1 M6\nT3\nM6\nM61 Q2\nT0 M6\nM2\n");
  std::vector<double> seen;
  for (asked.go(); asked.interpreter.waiting(); asked.go()) {
    seen.push_back(asked.tool());
    asked.interpreter.answer({});
  }
  EXPECT_EQ(seen, (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(asked.tool(), 0);
}

// As on a control that is switched on again.
TEST(ToolChange, TheToolInTheSpindleIsThatOfTheProgramBefore) {
  Session s;
  CanonText sink;
  s.run("T2 M6\nM2\n", sink);
  EXPECT_EQ(std::as_const(s.parameters)[parameter::kTool], 2);
  const MoveList list = s.moves("G21 G43\nG0 X#5400 Y[#<_current_tool>] Z#5410\nM2\n");
  ASSERT_EQ(list.moves.size(), 1U);
  EXPECT_EQ(list.moves[0].to[kX], 2);
  EXPECT_EQ(list.moves[0].to[kY], 2);
  EXPECT_EQ(list.moves[0].to[kZ], 10) << "its diameter";
  EXPECT_EQ(list.moves[0].context.tool_offset[2], 80.5);
}

TEST(ToolChange, BegunFurtherDownOnlyAToolThatIsNotThereIsAskedFor) {
  for (const int there : {0, 2}) {
    Session session;
    session.parameters[parameter::kTool] = there;
    Asked asked("G21 G90 F100\nT1 M6\nT2 M6 G43 H2\nG1 X5\nG1 X9\nM2\n", session);
    asked.interpreter.begin_at(5, {});
    EXPECT_EQ(asked.interpreter.asks_for_tool(), there == 0);
    EXPECT_EQ(asked.tool(), there) << "what the lines before would have changed is not in yet";
    EXPECT_EQ(asked.list.moves.empty(), there == 0);
    if (asked.interpreter.waiting()) asked.interpreter.answer({});
    asked.go();
    EXPECT_EQ(asked.tool(), 2);
    EXPECT_EQ(asked.list.moves.back().to[kX], 9);
    EXPECT_EQ(asked.list.moves.back().context.tool_offset[2], 80.5);
  }
}

Session with_sub() {
  Session session;
  session.config.tool_confirm = ToolConfirm::kSubProgram;
  session.config.tool_call = "change";
  return session;
}

// #1: the new tool, #2: the old one; M6 in it is the operator's part.
TEST(ToolChange, ASubProgramPutsTheToolIn) {
  Session session = with_sub();
  session.parameters[parameter::kTool] = 3;
  Asked asked(
      "o<change> sub\nG0 X#1 Y#2\nM6\nG0 Z[#5400]\no<change> endsub\nG21 G90\nT2 M6 G43 G0 X50\nG0 X60\nM2\n",
      session);
  asked.go();
  ASSERT_TRUE(asked.interpreter.asks_for_tool());
  ASSERT_EQ(asked.list.moves.size(), 1U);
  EXPECT_EQ(asked.list.moves[0].to[kX], 2);
  EXPECT_EQ(asked.list.moves[0].to[kY], 3);
  EXPECT_EQ(asked.tool(), 3);
  asked.interpreter.answer({});
  asked.go();
  ASSERT_EQ(asked.list.moves.size(), 4U);
  EXPECT_EQ(asked.list.moves[1].to[kZ], 2);
  EXPECT_EQ(asked.list.moves[2].to[kX], 50);
  EXPECT_EQ(asked.list.moves[2].context.tool_offset[2], 80.5) << "the block's rest comes behind it";
  EXPECT_EQ(asked.list.moves[3].to[kX], 60);
  EXPECT_EQ(asked.tool(), 2);
}

TEST(ToolChange, ASubProgramOfNoWaitChangesTheTool) {
  for (const char* end : {"o<change> endsub\n", "o<change> return\no<change> endsub\n"}) {
    const std::string program =
        std::string("o<change> sub\nG4 P0\n") + end + "T3 M6 G0 X1\nG0 Y[#5400]\nM2\n";
    Asked asked(program, with_sub());
    asked.go();
    EXPECT_FALSE(asked.interpreter.waiting());
    EXPECT_TRUE(asked.changes().empty());
    ASSERT_EQ(asked.list.moves.size(), 2U) << end;
    EXPECT_EQ(asked.list.moves[1].to[kY], 3);
  }
}

TEST(ToolChange, AnErrorInTheSubProgramLeavesTheOldTool) {
  Asked asked("o<change> sub\n(ABORT, magazine is empty)\no<change> endsub\nT3 M6\nM2\n", with_sub());
  EXPECT_THROW(asked.go(), GcodeError);
  EXPECT_EQ(asked.tool(), 0);
  Asked missing("T3 M6\nM2\n", with_sub());
  EXPECT_THROW(missing.go(), GcodeError);
}

ProgramConfig config_of(const std::string& text) { return read_program_config(parse_config(text, "m.toml")); }

std::string refusal(const std::string& text) {
  try {
    const ConfigTable root = parse_config(text, "m.toml");
    read_program_config(root);
    root.finish();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

TEST(ToolChange, TheSectionIsStrict) {
  EXPECT_EQ(config_of("").tool_confirm, ToolConfirm::kOperator);
  EXPECT_EQ(config_of("[tool_change]\n").tool_confirm, ToolConfirm::kOperator);
  EXPECT_EQ(config_of("[tool_change]\nconfirm = \"none\"\n").tool_confirm, ToolConfirm::kNobody);
  const ProgramConfig input = config_of("[io]\n[tool_change]\nconfirm = \"input\"\ninput = 7\n");
  EXPECT_EQ(input.tool_confirm, ToolConfirm::kInput);
  EXPECT_EQ(input.tool_input, 7);
  EXPECT_EQ(config_of("[tool_change]\nconfirm = \"sub-program\"\ncall = \"Change\"\n").tool_call, "change");
  EXPECT_NE(refusal("[tool_change]\nconfirm = \"input\"\ninput = 7\n").find("[io]"), std::string::npos);
  EXPECT_NE(refusal("[io]\n[tool_change]\nconfirm = \"input\"\n").find("input"), std::string::npos);
  EXPECT_NE(refusal("[tool_change]\ncall = \"change\"\n").find("\"sub-program\""), std::string::npos);
  EXPECT_NE(refusal("[tool_change]\nconfirm = \"sub-program\"\n").find("call"), std::string::npos);
  EXPECT_NE(refusal("[tool_change]\nconfirm = \"changer\"\n"), "");
  EXPECT_NE(refusal("[tool_change]\nconfrim = \"none\"\n").find("confirm"), std::string::npos);
}

// What the file held and nobody changed stays as it was, character for character.
TEST(ToolChange, ATableIsWrittenOverItsOwnText) {
  const std::string text = "; my tools\r\nT1 P1 D6 Z50 ;end mill\r\n\r\nT7 P2 Z+12.5 U1\r\nnonsense\n";
  ToolTable table = ToolTable::parse("T1 P1 D6 Z50 ;end mill\nT7 P2 Z+12.5\n", "t.tbl");
  EXPECT_EQ(table.text_over(text), text);
  table.at_or_new(1).offset[kZ] = 50.123456789012345;
  table.at_or_new(9).diameter = 0.1;
  const std::string changed = table.text_over(text);
  EXPECT_NE(changed.find("; my tools\r\nT1 P1 Z+50.12345678901234"), std::string::npos) << changed;
  EXPECT_NE(changed.find(" ;end mill\r\n\r\nT7 P2 Z+12.5 U1\r\nnonsense\nT9 P0 D+0.100000\n"),
            std::string::npos)
      << changed;
  const ToolTable again = ToolTable::parse(table.to_text(), "t.tbl");
  EXPECT_EQ(again.find(1)->offset[kZ], 50.123456789012345) << "the same bits";
  EXPECT_EQ(again.find(9)->diameter, 0.1);
  table.at_or_new(1) = *ToolTable::parse("T1 P1 D6 Z50 ;end mill", "t.tbl").find(1);
  EXPECT_EQ(table.text_over("T1 P1 D6 Z50 ;end mill\r\nT7 P2 Z+12.5\r\n"),
            "T1 P1 D6 Z50 ;end mill\r\nT7 P2 Z+12.5\r\nT9 P0 D+0.100000\r\n")
      << "a new line ends as the others do";
}

}  // namespace
}  // namespace trn
