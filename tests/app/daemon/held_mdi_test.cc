#include "app/daemon/held_mdi.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trn {
namespace {

HeldMdi plan_held_mdi(std::string_view text, double program_speed, int coolant) {
  return trn::plan_held_mdi(text, program_speed, coolant, HeldAt::kPath);
}

using Kind = RtCommand::Kind;

TEST(HeldMdi, SwitchesWhatMovesNothing) {
  const HeldMdi off = plan_held_mdi("m5 M9", 3000, 2);
  ASSERT_EQ(off.refusal, "");
  ASSERT_EQ(off.commands.size(), 2u);
  EXPECT_EQ(off.commands[0].kind, Kind::kSpindle);
  EXPECT_EQ(off.commands[0].value, 0);
  EXPECT_EQ(off.commands[1].kind, Kind::kCoolant);
  EXPECT_EQ(off.commands[1].joint, 0);
  EXPECT_EQ(plan_held_mdi("M3", 3000, 0).commands[0].value, 3000) << "the program's S";
  EXPECT_EQ(plan_held_mdi("M4 S500", 3000, 0).commands[0].value, -500);
  EXPECT_EQ(plan_held_mdi("M7", 0, 2).commands[0].joint, 3) << "mist beside the flood";
  const HeldMdi output = plan_held_mdi("M65 P12", 0, 0);
  EXPECT_EQ(output.commands[0].kind, Kind::kDigitalOutput);
  EXPECT_EQ(output.commands[0].joint, 12);
  EXPECT_EQ(output.commands[0].value, 0);
}

// A line acts as a whole or not at all, and says why.
TEST(HeldMdi, RefusesWhatTheHeldProgramGoesOnWith) {
  const std::vector<std::pair<std::string, std::string>> refused = {
      {"G0 X10", "an axis is moved with 'jog'"},
      {"G92 X10", "G92 would change what the held program goes on with"},
      {"X10", "an axis is moved with 'jog'"},
      {"M5 G54", "G54 would change"},
      {"G10 L20 P0 X0", "'start --resume' goes on from this place with them"},
      {"M61 Q2", "'stop' the program, set them, and 'start --resume'"},
      {"M6 T2", "a tool is changed where the program asks for one"},
      {"M3", "M3 needs a speed here"},
      {"M64", "M64 needs the output's number"},
      {"M64 P64", "P64 is none of them"},
      {"M64 P1.5", "P1.5 is none of them"},
      {"S2000", "S or P alone switches nothing"},
      {"M3 S[1+2]", "with plain numbers"},
      {"", "MDI takes M3"},
      {"M62 P1", "M62 is none of them"},
      {"M3 S-1", "S-1 is none of them"}};
  for (const auto& [line, why] : refused) {
    const HeldMdi order = plan_held_mdi(line, 0, 0);
    EXPECT_TRUE(order.commands.empty()) << line;
    EXPECT_NE(order.refusal.find(why), std::string::npos) << line << ": " << order.refusal;
  }
}

// Nothing behind a stop is read yet, so that the program goes on with what is set there.
TEST(HeldMdi, AtAStopItSetsOffsetsAndTools) {
  for (const char* line : {"G10 L20 P0 X0 Y0", "G10 L1 P3 Z50.2 R4", "G10 L1 P7 Z5 H3 (8 mm ball)", "M61 Q3",
                           "g10 l2 p2 x1\n\nM61 Q2"}) {
    const HeldMdi order = trn::plan_held_mdi(line, 0, 0, HeldAt::kStop);
    EXPECT_EQ(order.refusal, "") << line;
    EXPECT_TRUE(order.commands.empty());
    EXPECT_NE(order.lines, "") << line;
  }
  EXPECT_EQ(trn::plan_held_mdi("G10 L10 P1 Z0\nG43", 0, 0, HeldAt::kStop).lines, "G10 L10 P1 Z0\n")
      << "the length is in force anyway, or is not to be";
  EXPECT_EQ(trn::plan_held_mdi("M5", 0, 0, HeldAt::kStop).commands.size(), 1u);
  for (const char* line :
       {"G43", "G10 L1 P1 Z0 F3", "G10 L1 P1 Z0 Z1", "G10 L20 P0 X0\nG0 X5", "M61 Q[1]", "G92 X0"}) {
    const HeldMdi order = trn::plan_held_mdi(line, 0, 0, HeldAt::kStop);
    EXPECT_EQ(order.lines, "") << line;
    EXPECT_NE(order.refusal, "") << line;
  }
}

// The control does not know yet which tool is in.
TEST(HeldMdi, AtAToolChangeItSetsLengthsByTheirNumber) {
  EXPECT_NE(trn::plan_held_mdi("G10 L1 P3 Z50.2", 0, 0, HeldAt::kToolChange).lines, "");
  for (const char* line : {"G10 L10 P1 Z0\nG43", "M61 Q3", "G10 L20 P0 Z0"})
    EXPECT_NE(trn::plan_held_mdi(line, 0, 0, HeldAt::kToolChange).refusal.find("before 'resume' confirms it"),
              std::string::npos)
        << line;
}

}  // namespace
}  // namespace trn
