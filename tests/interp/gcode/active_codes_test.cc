#include "interp/gcode/active_codes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>

#include "core/machine.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/interpreter.h"
#include "tests/interp/gcode/run_program.h"

namespace trn {
namespace {

struct Nothing : CanonSink {
  void put(const CanonCommand&, std::uint32_t) override {}
};

std::string codes_behind(const std::string& program) {
  test::Session session;
  Nothing nothing;
  Interpreter interpreter({session.config, session.parameters, session.tools, nullptr, nothing, {}});
  interpreter.open_text(program, "p.ngc");
  // Its lines, and not its end, which resets modes.
  for (auto lines = 1 + std::count(program.begin(), program.end(), '\n'); lines > 0; --lines)
    interpreter.step();
  return active_codes(interpreter.settings(), interpreter.cutter_comp());
}

TEST(ActiveCodes, AreThoseThatTheProgramHasSet) {
  EXPECT_EQ(codes_behind("G21"), "G80 G17 G21 G90 G91.1 G94 G54 G49 G99 G64 G40 G97 M5 M9 M48");
  EXPECT_EQ(codes_behind("G20 G18 G91 G90.1 G95 G55 G98 G61 M3 S100 M7\nM8 M50 P0"),
            "G80 G18 G20 G91 G90.1 G95 G55 G49 G98 G61 G40 G97 M3 M7 M8 M50 P0");
  EXPECT_EQ(codes_behind("T2 M6\nG43 G0 X1 G64 P0.02 M49\nG92 X5"),
            "G0 G17 G21 G90 G91.1 G94 G54 G43 G99 G64 P0.02 G40 G92 G97 M5 M9 M49");
  EXPECT_EQ(codes_behind("G7 G96 D900 S50 M4 G93 G59.3 G61.1\nM51 P0"),
            "G80 G17 G21 G90 G91.1 G93 G59.3 G49 G99 G61.1 G40 G96 G7 M4 M9 M51 P0");
  EXPECT_EQ(codes_behind("T1 M6\nG41 G1 X20 F100"),
            "G1 G17 G21 G90 G91.1 G94 G54 G49 G99 G64 G41 G97 M5 M9 M48");
}

// The text itself, run as lines of a program, sets the same modes again.
TEST(ActiveCodes, ReadBackSetTheSameModes) {
  const std::string programs[] = {"G20 G19 G91 G94 G56 G98 G61 M3 S100 M8 M50 P0", "G64 P0.05 G95 M4 S10 M7",
                                  "G7 G93 G59.1 G61.1 M49 M5"};
  for (const std::string& program : programs) {
    const std::string codes = codes_behind(program);
    std::istringstream words(codes);
    std::string lines = "S100\n", word;
    while (words >> word) lines += word[0] == 'P' ? " " + word : "\n" + word;
    EXPECT_EQ(codes_behind(lines), codes) << lines;
  }
}

}  // namespace
}  // namespace trn
