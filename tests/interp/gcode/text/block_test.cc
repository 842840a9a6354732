#include "interp/gcode/text/block.h"

#include <gtest/gtest.h>

#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/parser.h"

namespace trn {
namespace {

struct NoState : StateValues {
  double predefined(int) const override { return 0; }
  double position(int) const override { return 0; }
};

/// Parses and evaluates lines; the last one stays.
struct Lines {
  Parameters parameters;
  NoState state;
  NameTable labels;
  ProgramConfig config;
  Parser parser{parameters.names(), labels, config.words};
  Evaluator evaluator{parameters, state};
  ModalTable table;
  ParsedBlock parsed;
  Block block;

  const Block& read(const std::string& line) {
    parser.parse(line, parsed);
    evaluate_block(parsed, evaluator, table, block);
    return block;
  }
  GcodeErrorCode error(const std::string& line) {
    try {
      read(line);
    } catch (const BlockError& error) {
      return error.code;
    }
    return GcodeErrorCode::kCount;
  }
};

TEST(Block, WordsHaveTheirValuesAndColumns) {
  Lines lines;
  const Block& b = lines.read("G1 X2.5 Y[1+2] M3");
  EXPECT_EQ(b.code(GGroup::kMotion), 1_g);
  EXPECT_EQ(b.code(MGroup::kSpindle), 3);
  EXPECT_FALSE(b.has(GGroup::kPlane));
  EXPECT_EQ(b['X'], 2.5);
  EXPECT_EQ(b['Y'], 3);
  EXPECT_EQ(b.at('Y'), 9U);
  EXPECT_FALSE(b.has('Z'));
  EXPECT_EQ(b.get('Z', 7), 7);
  EXPECT_TRUE(b.has_axis_word());
}

TEST(Block, NothingOfALineIsLeftForTheNext) {
  Lines lines;
  lines.read("G1 G17 X1 M3");
  const Block& b = lines.read("F100");
  EXPECT_FALSE(b.has(GGroup::kMotion) || b.has(GGroup::kPlane) || b.has(MGroup::kSpindle) || b.has('X'));
  EXPECT_FALSE(b.any_g || b.any_m || b.has_axis_word());
}

TEST(Block, WhatDoesNotGoTogetherIsRefused) {
  Lines lines;
  EXPECT_EQ(lines.error("G1 G2 X1"), GcodeErrorCode::kGroupConflict);
  EXPECT_EQ(lines.error("M3 M5"), GcodeErrorCode::kGroupConflict);
  EXPECT_EQ(lines.error("M2 M99"), GcodeErrorCode::kGroupConflict);
  EXPECT_EQ(lines.error("X1 X2"), GcodeErrorCode::kRepeatedWord);
  EXPECT_EQ(lines.error("G1.25"), GcodeErrorCode::kUnknownG);
  EXPECT_EQ(lines.error("G188"), GcodeErrorCode::kUnknownG);
  EXPECT_EQ(lines.error("M3.5"), GcodeErrorCode::kUnknownM);
  EXPECT_EQ(lines.error("M3 M8 M48 M62 M70"), GcodeErrorCode::kTooManyWords);
}

TEST(Block, G80GoesWithTheCodesOfItsGroup) {
  Lines lines;
  EXPECT_EQ(lines.read("G80 G1 X1").code(GGroup::kMotion), 1_g);
  EXPECT_EQ(lines.read("G1 G80 X1").code(GGroup::kMotion), 1_g);
}

}  // namespace
}  // namespace trn
