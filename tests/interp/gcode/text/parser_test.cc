#include "interp/gcode/text/parser.h"

#include <gtest/gtest.h>

#include "interp/gcode/error.h"
#include "interp/gcode/program_config.h"

namespace trn {
namespace {

struct ParsedLines {
  NameTable names, labels;
  ProgramConfig config;
  Parser parser{names, labels, config.words};
  ParsedBlock block;

  const ParsedBlock& read(const std::string& line) {
    parser.parse(line, block);
    return block;
  }
};

TEST(Parser, ALineIsItsWordsAssignmentsAndComment) {
  ParsedLines lines;
  const ParsedBlock& b = lines.read("/N10 G1 X#3 #5=7 (MSG, hello)");
  EXPECT_TRUE(b.block_delete);
  ASSERT_EQ(b.words.size(), 2U);
  EXPECT_EQ(b.words[0].letter, 'G');
  EXPECT_EQ(b.words[0].value, 1);
  EXPECT_EQ(b.words[1].letter, 'X');
  EXPECT_GE(b.words[1].expression, 0);
  ASSERT_EQ(b.assignments.size(), 1U);
  EXPECT_EQ(b.assignments[0].index, 5);
  EXPECT_EQ(b.comment_kind, CommentKind::kMessage);
}

TEST(Parser, OWordsHaveALabelAndArguments) {
  ParsedLines lines;
  const ParsedBlock& b = lines.read("o<Pocket> CALL [1] [2+3]");
  EXPECT_EQ(b.flow.kind, FlowKind::kCall);
  EXPECT_EQ(b.flow.label, lines.labels.intern("pocket"));
  EXPECT_EQ(b.flow.arguments.size(), 2U);
  EXPECT_EQ(lines.read("O1234").flow.kind, FlowKind::kProgramNumber);
}

TEST(Parser, OnlyLinesOfOWordsAreSeenWhereBlocksAreSkipped) {
  EXPECT_TRUE(Parser::is_flow_line("/n12 o100 endif"));
  EXPECT_FALSE(Parser::is_flow_line("G1 X1"));
  ParsedLines lines;
  lines.parser.parse_flow_only("o100 endif", lines.block);
  EXPECT_EQ(lines.block.flow.kind, FlowKind::kEndIf);
  lines.parser.parse_flow_only("this is no G code", lines.block);
  EXPECT_FALSE(lines.block.is_flow());
}

TEST(Parser, AnErrorHasTheColumnOfItsWord) {
  ParsedLines lines;
  try {
    lines.read("G1 X1 Y");
    FAIL() << "a word without a value";
  } catch (const BlockError& error) {
    EXPECT_EQ(error.code, GcodeErrorCode::kMissingValue);
    EXPECT_GE(error.column, 7U);
  }
}

}  // namespace
}  // namespace trn
