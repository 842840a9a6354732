#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "tests/support/paths.h"

// Errors behind moves that are planned, and perhaps driven, already: as where a program waits for an input
// first, and nobody can read on before it starts.
namespace trn {
namespace {

std::string zigzag(int moves) {
  std::string text = "G21 G90 G94 G64 P0.01 F3000\n";
  for (int i = 0; i < moves; ++i) text += fmt::format("G1 X{:.2f} Y{:.2f}\n", 0.5 * (i % 200), 0.7 * (i % 3));
  return text;
}

struct LateError {
  const char* lines;
  const char* told;  ///< in the message
};

constexpr LateError kErrors[] = {
    {"G64 P5\nG1 X10\nG1 Y20\n", "tolerance_mm_max"},
    {"S500 M3\nG33 Z-100 K100\n", "is too slow for this thread"},
    {"G1 X10\nG1 X100000\nG1 X5\n", "X"},
    {"G2 X0 Y0 I3000\n", ""},
    {"G1 X10 X20\n", ""},
    {"(ABORT, not today)\n", "not today"},
    {"G1 X5 F0\n", ""},
};

class LateErrorTest : public testing::Test {
 protected:
  LateErrorTest() : q_(JointVec::Zero(static_cast<Eigen::Index>(assembly_.machine.joints.size()))) {}
  ProgramStart start_of(const std::string& text) const { return {"part.ngc", text, q_}; }

  Assembly assembly_ = assemble(source_dir() + "/configs/mill.toml");
  JointVec q_;
  Parameters parameters_;
  ToolTable tools_;
};

TEST_F(LateErrorTest, TheMotionBeforeItEndsAtRest) {
  for (const LateError& error : kErrors)
    for (const int moves : {0, 1, 2, 7, 60, 500, 3000}) {
      SCOPED_TRACE(fmt::format("{} behind {} moves", error.lines, moves));
      Parameters parameters;
      ToolTable tools;
      Pipeline pipeline(assembly_, parameters, tools, start_of(zigzag(moves) + error.lines + "M2\n"), {});
      std::string message;
      MotionBlock block, last, last_motion;
      for (bool more = true; more;) {
        try {
          more = pipeline.next(block);
          if (!more) break;
          last = block;
          if (block.segment_count > 0) last_motion = block;
        } catch (const ProgramError& failure) {
          EXPECT_EQ(message, "") << "told once";
          message = failure.what();
        }
      }
      EXPECT_NE(message, "");
      EXPECT_NE(message.find(error.told), std::string::npos) << message;
      EXPECT_NE(message.find("part.ngc:"), std::string::npos) << message;
      EXPECT_EQ(last.event.kind, QueueEvent::Kind::kProgramEnd);
      EXPECT_EQ(last.segment_count, 0);
      EXPECT_TRUE(last_motion.segment_count == 0 || last_motion.ends_at_rest);
    }
}

// What the machine's own rules refuse is refused before anything moves, however far behind it stands.
TEST_F(LateErrorTest, TheCheckBeforeTheStartKnowsTheMachinesRules) {
  for (const LateError& error : {kErrors[0], kErrors[1]})
    for (const int moves : {0, 1, 1500}) {
      try {
        check_program(assembly_, parameters_, tools_, start_of(zigzag(moves) + error.lines + "M2\n"), {},
                      nullptr);
        ADD_FAILURE() << error.lines << " behind " << moves;
      } catch (const ProgramError& failure) {
        const std::string message = failure.what();
        EXPECT_NE(message.find(error.told), std::string::npos) << message;
        EXPECT_EQ(message.find(fmt::format("part.ngc:{}:", moves + 3)), 0u) << message;
      }
    }
}

}  // namespace
}  // namespace trn
