#include "app/session/place_record.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

// Blocks that are run: line 1 is the first, lines 3 and 4 are 2 and 3, 4 and 5, 6 and 7.
constexpr const char* kLoop =
    "G21 G90 G94 M3 S1000\no1 repeat [3]\nG91 G1 X10 F600\nG1 Y10\no1 endrepeat\nM2\n";

PlaceRecord second_pass() {
  PlaceRecord place;
  place.program = "/nc/part.ngc";
  place.block = 5;
  place.line = 4;
  place.file = "part.ngc";
  place.text = "G1 Y10";
  place.gone_mm = 2;
  place.moves = true;
  place.to = {{20, 20, 0}, Vec3::Zero()};
  return place;
}

class Places : public testing::Test {
 protected:
  ProgramStart start(const std::string& text) const {
    ProgramStart out{"part", text, JointVec::Zero(3)};
    out.switches = ProgramSwitches::of(assembly_);
    return out;
  }
  PlaceEntry entry(const PlaceRecord& place, double before_mm, const std::string& text = kLoop) const {
    return find_entry(assembly_, parameters_, tools_, start(text), place, before_mm);
  }
  std::string refusal(const PlaceRecord& place, const std::string& text = kLoop) const {
    try {
      entry(place, 1, text);
    } catch (const ProgramError& error) {
      return error.what();
    }
    return "";
  }
  std::vector<Words> ends(std::uint64_t from_block) {
    std::vector<Words> out;
    PipelineObservers observers;
    observers.move = [&](const ProgramMove& move) { out.push_back(move.to); };
    ProgramStart from = start(kLoop);
    from.from_block = from_block;
    Pipeline pipeline(assembly_, parameters_, tools_, from, observers);
    MotionBlock block;
    while (pipeline.next(block)) {
    }
    return out;
  }
  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  Parameters parameters_;
  ToolTable tools_;
};

TEST_F(Places, TheFileHasAllOfIt) {
  PlaceRecord place = second_pass();
  place.mark = "0123456789abcdef";
  place.tool = 7;
  place.left_mm = 8.25;
  place.codes = "G1 G17";
  place.work_offset = "G54 X1.0000";
  place.spindle_rpm = -3000.5;
  place.coolant = 2;
  place.work = "X1.0000";
  place.block_delete = true;
  place.optional_stop = false;
  place.block_delete_changes = {{0, false}, {17, true}};
  place.began = JointVec::Constant(3, 1.25);
  place.at = MmWords{{1, 2, 1.0 / 3}, Vec3::Zero()};
  place.measured.numbers[5221] = {0.1 + 0.2, 12};
  place.measured.tools[3] = {Tool{3, 2, 1, {{0, 0, 1.0 / 3}, Vec3::Zero()}, 6, 1, 2, 3, "ball"}, 12};
  place.measured.tools[4] = {std::nullopt, 12};
  const std::string text = place_file_text(place);
  EXPECT_EQ(place_file_text(parse_place(text, "m.place")), text);
  EXPECT_EQ(parse_place(text, "m.place").block_delete_changes, place.block_delete_changes);
  EXPECT_EQ(parse_place(text, "m.place").began, place.began);
  EXPECT_EQ(parse_place(text, "m.place").measured, place.measured);
  EXPECT_THROW(parse_place(text.substr(0, text.size() / 2), "m.place"), ProgramError);
  EXPECT_THROW(parse_place("{}", "m.place"), ProgramError);
  for (const char* number : {"99", "6000"}) {  // no offset of the machine
    std::string other = text;
    other.replace(other.find("5221"), 4, number);
    EXPECT_THROW(parse_place(other, "m.place"), ProgramError) << number;
  }
}

TEST_F(Places, AProgramThatHasEndedOrNotBegunHasNone) {
  PlaceRecord place = second_pass();
  EXPECT_NO_THROW(refuse_without_place(place));
  const auto told = [&] {
    try {
      refuse_without_place(parse_place(place_file_text(place), "m.place"));
    } catch (const ProgramError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  place.ended = true;
  EXPECT_NE(told().find("/nc/part.ngc has come to its end"), std::string::npos);
  place.ended = false;
  place.block = 0;
  EXPECT_NE(told().find("had not begun its first line"), std::string::npos);
}

TEST_F(Places, ALineThatIsFarEnoughBeforeIsFound) {
  EXPECT_EQ(entry(second_pass(), 1).block, 5u) << "2 mm of the line are done";
  EXPECT_EQ(entry(second_pass(), 1).line, 4u);
  EXPECT_EQ(entry(second_pass(), 2.5).block, 4u);
  EXPECT_EQ(entry(second_pass(), 2.5).line, 3u);
  EXPECT_EQ(entry(second_pass(), 12).block, 4u);
  EXPECT_EQ(entry(second_pass(), 12.5).block, 3u) << "in the pass before";
  EXPECT_EQ(entry(second_pass(), 1000).block, 1u);
}

// The loop counts on from where it began: the machine stands elsewhere by now.
TEST_F(Places, AProgramThatCountsOnFromItsBeginningIsGoneThroughFromThere) {
  ProgramStart from = start(kLoop);
  from.q << 5, 9, 0;
  EXPECT_THROW(find_entry(assembly_, parameters_, tools_, from, second_pass(), 1), ProgramError);
  from.began = JointVec::Zero(3);
  EXPECT_EQ(find_entry(assembly_, parameters_, tools_, from, second_pass(), 1).block, 5U);
  from.from_block = 5;
  from.from_line = 4;
  std::vector<Words> here;
  PipelineObservers observers;
  observers.move = [&](const ProgramMove& move) { here.push_back(move.to); };
  Pipeline pipeline(assembly_, parameters_, tools_, from, observers);
  MotionBlock block;
  while (pipeline.next(block)) {
  }
  ASSERT_FALSE(here.empty());
  EXPECT_NEAR((here.back() - ends(5).back()).norm(), 0, 1e-9);
}

TEST_F(Places, TheAnswerSaysHowMuchIsDrivenAgain) {
  EXPECT_NEAR(entry(second_pass(), 1).before_mm, 1, 1e-9);
  EXPECT_NEAR(entry(second_pass(), 2.5).before_mm, 2.5, 1e-9);
  EXPECT_NE(place_text(second_pass(), entry(second_pass(), 2.5))
                .find("9.5 mm behind its beginning, and cuts 2.5 mm"),
            std::string::npos)
      << place_text(second_pass(), entry(second_pass(), 2.5));
  PlaceRecord drilled = second_pass();  // in the cycle of line 3: it is gone back to a whole line
  drilled.block = 3;
  drilled.line = 3;
  drilled.text = "G81 X50 Z-5 R2";
  drilled.gone_mm = 7;
  drilled.to = {{50, 0, -5}, Vec3::Zero()};
  const PlaceEntry whole = entry(drilled, 1, "G21 G90 G94 F600\nG1 X0.5 Z10\nG81 X50 Z-5 R2\nM2\n");
  EXPECT_EQ(whole.line, 3u);
  EXPECT_FALSE(whole.place);
  EXPECT_NE(place_text(drilled, whole).find("with line 3 from its beginning, at least 7.0 mm"),
            std::string::npos);
}

// From the middle of a long line on, the path is the one that it would have been: also in G91, in inches, in
// a turned system, and where the line was begun on its middle once before.
TEST_F(Places, ALongLineIsEnteredTheDistanceBeforeThePlace) {
  struct Case {
    const char* text;
    PlaceRecord place;
    Vec3 enters;  ///< 1 mm before the place, worked out by hand, mm in the machine
  };
  const auto place = [](const char* line, double gone, double left, const Vec3& to) {
    PlaceRecord out;
    out.program = "/nc/part.ngc";
    out.block = 3;
    out.line = 3;
    out.file = "part.ngc";
    out.text = line;
    out.gone_mm = gone;
    out.left_mm = left;
    out.moves = true;
    out.to = {to, Vec3::Zero()};
    return out;
  };
  const Case cases[] = {
      {"G21 G90 G94 F600\nG1 Z-2\nG1 X200\nG1 Y5\nM2\n",
       place("G1 X200", 120, -1, {200, 0, -2}),
       {119, 0, -2}},
      {"G21 G91 G94 F600\nG1 Z-2\nG1 X200\nG1 Y5\nM2\n",
       place("G1 X200", 120, 80, {200, 0, -2}),
       {119, 0, -2}},
      {"G20 G91 G94 F20\nG1 Z-1\nG1 X3 Y4\nG1 Y1\nM2\n",
       place("G1 X3 Y4", 11, 116, {76.2, 101.6, -25.4}),
       {6, 8, -25.4}},
      {"G10 L2 P1 R90\nG21 G90 G94 F600 G1 Z-2\nG1 X200\nG1 Y5\nM2\n",
       place("G1 X200", 120, 80, {200, 0, -2}),
       {0, 119, -2}},
  };
  for (const Case& c : cases) {
    ProgramStart from = start(c.text);
    const PlaceEntry found = find_entry(assembly_, parameters_, tools_, from, c.place, 1);
    EXPECT_EQ(found.block, 3u) << c.text;
    EXPECT_NEAR(found.before_mm, 1, 1e-6);
    ASSERT_TRUE(found.place) << c.text;
    const auto moves_of = [&](const ProgramStart& begun) {
      std::vector<ProgramMove> out;
      PipelineObservers observers;
      observers.move = [&](const ProgramMove& move) { out.push_back(move); };
      Parameters parameters = parameters_;
      ToolTable tools = tools_;
      Pipeline pipeline(assembly_, parameters, tools, begun, observers);
      MotionBlock block;
      while (pipeline.next(block)) {
      }
      return out;
    };
    const std::vector<ProgramMove> whole = moves_of(from);
    from.from_block = found.block;
    from.from_line = found.line;
    from.from_place = found.place;
    const std::vector<ProgramMove> again = moves_of(from);
    ASSERT_GE(again.size(), 3u) << c.text;
    const ProgramMove &cut = again[again.size() - 2], &last = again.back();
    EXPECT_EQ(cut.kind, ProgramMove::Kind::kFeed);
    EXPECT_NEAR((cut.from.head<3>() - c.enters).norm(), 0, 1e-6) << c.text << cut.from.transpose();
    EXPECT_NEAR((cut.to - whole[whole.size() - 2].to).norm(), 0, 1e-9) << c.text;
    EXPECT_NEAR((last.to - whole.back().to).norm(), 0, 1e-9) << c.text;
    EXPECT_NEAR((last.from - whole.back().from).norm(), 0, 1e-9) << c.text;
  }
}

struct ArcCase {
  const char* text;
  double radius, turns, rise;         ///< mm, in the sense in which it is driven
  Vec3 centre, first, second, along;  ///< where it begins, a quarter turn on, and the rise; machine
  double gone_turns;                  ///< the place
  double left_mm;                     ///< as the record has it, about; below 0: not known
};
const Vec3 kAlongX = Vec3::UnitX(), kAlongY = Vec3::UnitY(), kAlongZ = Vec3::UnitZ();
const ArcCase kArcs[] = {
    {"G21 G90 G94 F600\nG1 X40\nG3 X40 Y0 I-40\nG1 Y5\nM2\n", 40, 1, 0, Vec3::Zero(), kAlongX, kAlongY,
     kAlongZ, 0.7, -1},
    {"G21 G90 G94 F600\nG1 X40\nG2 X0 Y40 Z-8 I-40 P3\nG1 Y50\nM2\n", 40, 2.75, -8, Vec3::Zero(), kAlongX,
     -kAlongY, kAlongZ, 1.6, 289},
    {"G20 G91 G94 F20\nG1 X1\nG2 X1 Y-1 R1\nG1 X1\nM2\n",
     25.4,
     0.25,
     0,
     {25.4, -25.4, 0},
     kAlongY,
     kAlongX,
     kAlongZ,
     0.125,
     20},
    {"G10 L2 P1 R90\nG21 G90 G94 F600 G1 X40\nG3 X-40 Y0 I-40\nG1 Y5\nM2\n", 40, 0.5, 0, Vec3::Zero(),
     kAlongY, -kAlongX, kAlongZ, 0.3, -1},
    {"G21 G90 G94 F600 G18\nG1 X40\nG2 X-40 Z0 Y6 I-40 P2\nG1 X5\nM2\n", 40, 1.5, 6, Vec3::Zero(), kAlongX,
     kAlongZ, kAlongY, 1.2, 75},
};

// Of a circle or helix that is entered within, what is left is the same curve: from the place in closed form
// to the end of the whole. In turned and other planes, in inches, over several turns, and begun within
// before.
TEST_F(Places, AnArcIsEnteredTheDistanceBeforeThePlace) {
  for (const ArcCase& c : kArcs) {
    const auto at = [&](double turns) {
      const double angle = turns * 2 * kPi;
      return Vec3(c.centre + c.radius * (c.first * std::cos(angle) + c.second * std::sin(angle)) +
                  c.along * c.rise * turns / c.turns);
    };
    const double length = std::hypot(c.radius * 2 * kPi * c.turns, c.rise), one_mm = c.turns / length;
    ProgramStart from = start(c.text);
    std::vector<ProgramMove> whole, again;
    const auto moves_of = [&](std::vector<ProgramMove>& out) {
      PipelineObservers observers;
      observers.move = [&](const ProgramMove& move) { out.push_back(move); };
      Parameters parameters = parameters_;
      ToolTable tools = tools_;
      Pipeline pipeline(assembly_, parameters, tools, from, observers);
      MotionBlock block;
      while (pipeline.next(block)) {
      }
    };
    moves_of(whole);
    ASSERT_EQ(whole.size(), 3u) << c.text;
    PlaceRecord place;
    place.block = place.line = 3;
    place.moves = true;
    const bool turned = std::string(c.text).find("R90") != std::string::npos;
    const auto in_program = [&](const Vec3& p) { return turned ? Vec3(p.y(), -p.x(), p.z()) : p; };
    place.to = {in_program(at(c.turns)), Vec3::Zero()};
    place.at = MmWords{in_program(at(c.gone_turns)), Vec3::Zero()};
    place.left_mm = c.left_mm;
    place.gone_mm = c.gone_turns / one_mm + 3;  // not exact, as the daemon's
    const PlaceEntry found = find_entry(assembly_, parameters_, tools_, from, place, 1);
    EXPECT_EQ(found.block, 3u) << c.text;
    EXPECT_NEAR(found.before_mm, 1, 1e-6);
    ASSERT_TRUE(found.place) << c.text;
    from.from_block = found.block;
    from.from_line = found.line;
    from.from_place = found.place;
    moves_of(again);
    ASSERT_GE(again.size(), 3u) << c.text;
    const ProgramMove& cut = again[again.size() - 2];
    ASSERT_EQ(cut.kind, ProgramMove::Kind::kArc) << c.text;
    const double entered = c.gone_turns - one_mm;
    EXPECT_NEAR((Vec3(cut.from.head<3>()) - at(entered)).norm(), 0, 1e-6) << c.text << cut.from.transpose();
    EXPECT_NEAR((cut.to - whole[1].to).norm(), 0, 1e-9) << c.text;
    EXPECT_NEAR((again.back().to - whole[2].to).norm(), 0, 1e-9) << c.text;
    const PathPiece arc = make_arc(cut.from, cut.to, cut.arc_centre, cut.arc_axis, cut.arc_sweep_rad);
    for (int i = 0; i <= 20; ++i) {
      const Vec3 on = arc.at(arc.length * i / 20).head<3>();
      EXPECT_NEAR((on - at(entered + (c.turns - entered) * i / 20)).norm(), 0, 1e-6) << c.text << i;
    }
  }
}

// Where the end of an arc misses its circle, the whole is driven about a centre that was moved to fit, and so
// is what is left of it.
TEST_F(Places, TheCentreOfAnArcThatWasMovedToFitStaysWhereItWas) {
  ProgramStart from = start("G21 G90 G94 F600\nG1 X40\nG3 X-40.02 Y0 I-40\nM2\n");
  const auto arc_of = [&] {
    ProgramMove arc;
    PipelineObservers observers;
    observers.move = [&](const ProgramMove& move) {
      if (move.kind == ProgramMove::Kind::kArc) arc = move;
    };
    Parameters parameters = parameters_;
    ToolTable tools = tools_;
    Pipeline pipeline(assembly_, parameters, tools, from, observers);
    MotionBlock block;
    while (pipeline.next(block)) {
    }
    return arc;
  };
  const ProgramMove whole = arc_of();
  PlaceRecord place;
  place.block = place.line = 3;
  place.moves = true;
  place.to = {{-40.02, 0, 0}, Vec3::Zero()};
  const double r = 40.01;
  place.at = MmWords{{r * std::cos(0.4) - 0.01, r * std::sin(0.4), 0}, Vec3::Zero()};
  const PlaceEntry found = find_entry(assembly_, parameters_, tools_, from, place, 0);
  from.from_block = found.block;
  from.from_place = found.place;
  const ProgramMove rest = arc_of();
  EXPECT_NEAR(whole.arc_centre.x(), -0.01, 1e-9);
  EXPECT_NEAR((rest.arc_centre - whole.arc_centre).norm(), 0, 1e-9);
  EXPECT_NEAR(rest.arc_sweep_rad, kPi - 0.4, 1e-6);
}

// The lines behind the switch count as they did then.
TEST_F(Places, BlockDeleteThatWasSwitchedMeanwhileIsFollowed) {
  const std::string text = "G21 G90\nG1 X10 F600\n/G1 Y5\nG1 X20\n/G1 Y7\nG1 X30\nM2\n";
  PlaceRecord place;
  place.block = 5;
  place.line = 6;
  place.text = "G1 X30";
  place.moves = true;
  place.to[0] = 30;
  place.to[1] = 5;
  place.block_delete_changes = {{0, false}, {4, true}};
  ProgramStart from = start(text);
  from.switches.block_delete = place.block_delete = true;
  EXPECT_THROW(find_entry(assembly_, parameters_, tools_, from, place, 0), ProgramError) << "line 3 was run";
  from.block_delete_changes = place.block_delete_changes;
  EXPECT_EQ(find_entry(assembly_, parameters_, tools_, from, place, 0).line, 6U);
  // From line 2 on, too: line 3 is run, line 5 is skipped.
  from.from_block = 2;
  std::vector<std::uint32_t> lines;
  PipelineObservers observers;
  observers.move = [&](const ProgramMove& move) {
    if (move.source.line > 0) lines.push_back(move.source.line);
  };
  Pipeline pipeline(assembly_, parameters_, tools_, from, observers);
  MotionBlock block;
  while (pipeline.next(block)) {
  }
  EXPECT_EQ(lines, (std::vector<std::uint32_t>{2, 3, 4, 6}));
}

TEST_F(Places, WhatIsNotTheSameAnyMoreIsRefused) {
  ASSERT_EQ(refusal(second_pass()), "");
  PlaceRecord place = second_pass();
  place.tool = 3;
  EXPECT_NE(refusal(place).find("the program was given up with tool 3"), std::string::npos);
  place = second_pass();
  place.block_delete = true;
  EXPECT_NE(refusal(place).find("ran with block delete on"), std::string::npos);
  place = second_pass();
  place.block = 4;
  EXPECT_NE(refusal(place).find("it is in line 3 by then"), std::string::npos);
  place = second_pass();
  place.block = 50;
  EXPECT_NE(refusal(place).find("it ends before"), std::string::npos);
  place = second_pass();
  place.to[kY] = 20.001;
  EXPECT_NE(refusal(place).find("another place there, for variables have changed"), std::string::npos);
  place.measured.numbers[5222] = {3, 2};
  EXPECT_NE(refusal(place).find("offsets were set at a stop, and no line has named every axis since"),
            std::string::npos);
  EXPECT_NE(refusal(second_pass(), "G21 G90\nM66 P0 L0\n#1=1\n#2=2\n#3=3\nM2\n").find("asks the machine"),
            std::string::npos);
}

// The length of the tool or the offset may be others by now.
TEST_F(Places, AnOffsetThatWasSetAnewIsNoHindrance) {
  parameters_[5221] = 12.5;
  PlaceRecord place = second_pass();
  place.block = place.line = 3;
  place.text = "G1 X20 Y20";
  EXPECT_EQ(refusal(place, "G21 G90\nG1 X20 Y10 F600\nG1 X20 Y20\nM2\n"), "");
}

// G10 and M61 in the program set what they set, unless the operator has set it himself since.
TEST_F(Places, WhatTheOperatorHasMeasuredSinceIsKept) {
  const char* const kSets =
      "G21 G90 G10 L2 P1 X1 Y2\nM61 Q1\nG10 L1 P1 Z50\nG43\nG0 X0 Y0 Z60\nG1 X20 F600\nG1 X30\nM2\n";
  tools_ = ToolTable::parse("T1 P1 Z40\nT2 P2 Z70\n", "tools.tbl");
  PlaceRecord place;
  place.block = place.line = 7;
  place.text = "G1 X30";
  place.moves = true;
  place.to = {{30, 0, 60}, Vec3::Zero()};
  place.tool = 2;
  place.measured.numbers[5221] = {9, 6};
  place.measured.numbers[parameter::kTool] = {2, 6};
  place.measured.tools[1] = {Tool{1, 1, 1, {{0, 0, 45}, Vec3::Zero()}, 0, 0, 0, 0, ""}, 6};
  place.measured.numbers[5241] = {3, 6};  // no line of the program sets it
  for (const bool since : {false, true}) {
    ProgramStart from = start(kSets);
    if (since) from.measured = place.measured;
    if (!since) place.tool = 0;
    Parameters parameters = parameters_;
    ToolTable tools = tools_;
    if (since) parameters[parameter::kTool] = place.tool = 2;
    const PlaceEntry found = find_entry(assembly_, parameters, tools, from, place, 1);
    EXPECT_EQ(found.kept,
              since ? "X of G54 (line 1), the tool in the spindle (line 2), tool 1 (line 3)" : "");
    from.from_block = found.block;
    from.from_line = found.line;
    Words end = Words::Zero();
    double length = 0;
    PipelineObservers observers;
    observers.move = [&](const ProgramMove& move) {
      end = move.to;
      length = move.context.tool_offset.z();
    };
    Pipeline pipeline(assembly_, parameters, tools, from, observers);
    if (pipeline.waiting()) pipeline.answer({});
    MotionBlock block;
    while (pipeline.next(block) || pipeline.waiting())
      if (pipeline.waiting()) pipeline.answer({});
    EXPECT_NEAR(end[kX], since ? 39 : 31, 1e-9);
    EXPECT_NEAR(end[kY], 2, 1e-9);
    EXPECT_NEAR(length, since ? 70 : 50, 1e-9);
    EXPECT_EQ(tools.find(1)->offset[kZ], since ? 45 : 50);
    EXPECT_EQ(parameters[parameter::kTool], since ? 2 : 1);
    EXPECT_EQ(parameters[5241], since ? 3 : 0);
  }
}

TEST_F(Places, WhatIsKeptIsNamedByItsWorkOffset) {
  PlaceRecord place;
  place.block = place.line = 5;
  place.text = "G1 X30";
  place.moves = true;
  place.to = {{30, 0, 0}, Vec3::Zero()};
  place.measured.numbers[5242] = {9, 4};
  ProgramStart from = start("G21 G90\nG10 L2 P2 Y2\nG0 X0\nG1 X20 F600\nG1 X30\nM2\n");
  from.measured = place.measured;
  Parameters parameters = parameters_;
  ToolTable tools = tools_;
  EXPECT_EQ(find_entry(assembly_, parameters, tools, from, place, 1).kept, "Y of G55 (line 2)");
}

// Lines behind the block up to which it counts set it as ever.
TEST_F(Places, WhatWasMeasuredCountsUpToItsPlace) {
  ProgramStart from = start("G21 G90 G10 L2 P1 X1\nG1 X10 F600\nG10 L2 P1 X2\nG1 X11\nM2\n");
  from.measured.numbers[5221] = {9, 2};
  std::vector<double> ends;
  PipelineObservers observers;
  observers.move = [&](const ProgramMove& move) { ends.push_back(move.to[kX]); };
  Pipeline pipeline(assembly_, parameters_, tools_, from, observers);
  MotionBlock block;
  while (pipeline.next(block)) {
  }
  ASSERT_EQ(ends.size(), 2u);
  EXPECT_NEAR(ends[0], 19, 1e-9);
  EXPECT_NEAR(ends[1], 13, 1e-9);
}

TEST_F(Places, ContourCompensationIsEnteredBeforeItBegins) {
  tools_ = ToolTable();
  const char* const kContour = "G21 G90\nG0 X-20\nG41.1 D4 G1 X0 F600\nX30\nY30\nX0\nG40 G1 X-20\nM2\n";
  PlaceRecord place = second_pass();
  place.moves = false;
  place.text = "";
  place.block = 5;
  EXPECT_EQ(entry(place, 1, kContour).line, 3u) << "the line with G41.1 itself";
}

// The way to the first block is an approach like any other: up, across and down.
TEST_F(Places, TheFirstBlockIsEnteredFromAbove) {
  ProgramStart from = start("G21 G90 G94 G1 X50 F600\nG1 Y5\nM2\n");
  from.q << 20, 30, -10;
  from.began = JointVec::Zero(3);
  from.from_block = 1;
  from.from_place = EntryPlace{{{25, 0, 0}, Vec3::Zero()}, 0};
  std::vector<ProgramMove> moves;
  PipelineObservers observers;
  observers.move = [&](const ProgramMove& move) { moves.push_back(move); };
  Pipeline pipeline(assembly_, parameters_, tools_, from, observers);
  MotionBlock block;
  while (pipeline.next(block)) {
  }
  ASSERT_GE(moves.size(), 4u);
  EXPECT_EQ(moves.front().to[kZ], 240) << "safe_z_mm of the config";
  const ProgramMove& cut = moves[moves.size() - 2];
  EXPECT_NEAR((cut.from.head<3>() - Vec3(25, 0, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((cut.to.head<3>() - Vec3(50, 0, 0)).norm(), 0, 1e-9);
}

TEST_F(Places, TheProgramGoesOnInThatPass) {
  const std::vector<Words> whole = ends(0), rest = ends(5);
  ASSERT_EQ(whole.size(), 6u);
  ASSERT_GE(rest.size(), 3u);
  for (std::size_t i = 1; i <= 3; ++i)
    EXPECT_LT((rest[rest.size() - i] - whole[whole.size() - i]).norm(), 1e-12) << i;
}

}  // namespace
}  // namespace trn
