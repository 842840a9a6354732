#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/move.h"
#include "tests/interp/gcode/run_program.h"

// TANGON: the words of the axis that turns the knife, as canonical functions and as moves.
namespace trn {
namespace {

test::Session cutter() { return test::shipped("tangential_knife"); }

/// "T 1 2 3 45": a traverse to X1 Y2 Z3 C45; "F ...": a feed. Other lines stay.
std::string cuts(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    double x = 0, y = 0, z = 0, c = 0;
    char kind = 0;
    if (std::sscanf(line.c_str(), "%c %lf %lf %lf %lf", &kind, &x, &y, &z, &c) == 5)
      text += fmt::format("STRAIGHT_{}({:.4f}, {:.4f}, {:.4f}, 0.0000, 0.0000, {:.4f})\n",
                          kind == 'T' ? "TRAVERSE" : "FEED", x, y, z, c);
    else
      text += line + "\n";
  }
  return text;
}

std::string knife(const std::string& program) {
  const std::string text = cutter().canon("G21 G94 F1000\nTANGON\n" + program + "\nTANGOF");
  const std::size_t last = text.find("USE_LENGTH_UNITS");
  return text.substr(text.find('\n', last) + 1);
}

TEST(Knife, TurnsInTheRapidBeforeTheCut) {
  EXPECT_EQ(knife("G0 X10 Y0 Z5\nG1 Z-1\nX20 Y10\nG0 Z5"),
            cuts({"T 10 0 5 45", "F 10 0 -1 45", "F 20 10 -1 45", "T 20 10 5 45"}));
  // Here no rapid crosses: it turns above the work. A message does not wait, a dwell ends the waiting.
  EXPECT_EQ(knife("G0 Z5\nG1 Z-1\nX0 Y10"), cuts({"T 0 0 5 0", "T 0 0 5 90", "F 0 0 -1 90", "F 0 10 -1 90"}));
  EXPECT_EQ(knife("G0 Z5\nG4 P1\nG1 Z-1\nX0 Y-10"),
            cuts({"T 0 0 5 0", "DWELL(1.0000)", "T 0 0 5 -90", "F 0 0 -1 -90", "F 0 -10 -1 -90"}));
}

TEST(Knife, GoesUpAtASharpCornerAndTurnsOnTheSpotAtAMiddlingOne) {
  EXPECT_EQ(knife("G1 X10\nY10"),
            cuts({"F 10 0 0 0", "T 10 0 8 0", "T 10 0 8 90", "F 10 0 0 90", "F 10 10 0 90"}));
  const double ten = std::tan(rad_from_deg(10)) * 10;
  EXPECT_EQ(knife(fmt::format("G1 X10\nX20 Y{:.9f}", ten)),
            cuts({"F 10 0 0 0", "T 10 0 0 10", fmt::format("F 20 {:.9f} 0 10", ten)}));
  // Back along the same line, and deeper before the next cut: both are in the work.
  EXPECT_EQ(knife("G1 X10\nX0"),
            cuts({"F 10 0 0 0", "T 10 0 8 0", "T 10 0 8 180", "F 10 0 0 180", "F 0 0 0 180"}));
  EXPECT_EQ(knife("G1 X10\nZ-1\nY10"), cuts({"F 10 0 0 0", "F 10 0 -1 0", "T 10 0 7 0", "T 10 0 7 90",
                                             "F 10 0 -1 90", "F 10 10 -1 90"}));
  // The lift is in mm, the program in inches.
  EXPECT_NE(cutter()
                .canon("G20 G94 F10\nTANGON\nG1 X1\nY1\nTANGOF")
                .find("STRAIGHT_TRAVERSE(1.0000, 0.0000, 0.3150"),
            std::string::npos);
}

TEST(Knife, TurnsOnItsWayAtAFlatCorner) {
  const double y = std::tan(rad_from_deg(3)) * 10;
  EXPECT_EQ(knife(fmt::format("G1 X10\nX20 Y{:.9f}\nX30 Y{:.9f}", y, 2 * y)),
            cuts({"F 10 0 0 1.5", fmt::format("F 20 {:.9f} 0 3", y), fmt::format("F 30 {:.9f} 0 3", 2 * y)}));
}

TEST(Knife, TurnsWithAnArc) {
  // A line that leads into an arc without a corner; two turns of a helix; and clockwise.
  const auto moves =
      cutter()
          .moves(
              "G21 G94 F1000\nTANGON\nG1 X10\nG3 X10 Y20 J10\nG3 X10 Y20 Z-2 J-10 P2\nG2 I-5\nTANGOF\nM2\n")
          .moves;
  std::vector<double> words;
  for (const ProgramMove& move : moves) words.push_back(deg_from_rad(move.to[kC]));
  // At the end of the helix it stands at 900 degrees and points to -X; the clockwise circle begins
  // downwards.
  const std::vector<double> wanted{0, 180, 900, 900, 990, 990, 630};
  ASSERT_EQ(words.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(words[i], wanted[i], 1e-9) << i;
}

// The axis' word is that of the work offset, which may be turned about Z.
TEST(Knife, PointsAlongThePathInATurnedWorkOffset) {
  const auto moves =
      cutter()
          .moves("G21 G94 F1000\nG10 L2 P1 X3 Y4 C20 R30\nG0 X0 Y0\nTANGON\nG1 X10 Y10\nTANGOF\nM2\n")
          .moves;
  ASSERT_GE(moves.size(), 2u);
  const Words& cut = moves.back().to;
  const Words way = cut - moves.back().from;
  EXPECT_NEAR(deg_from_rad(std::atan2(way[kY], way[kX])), 75, 1e-9);
  EXPECT_NEAR(deg_from_rad(cut[kC]), 75, 1e-9);
}

// Behind it the program knows where the axis stands.
TEST(Knife, LeavesTheAxisWhereItStands) {
  const auto moves = cutter().moves("G21 G94 F1000\nTANGON\nG1 X0 Y10\nTANGOF\n#100=#<_c>\nG1 X5\nC7\nM2\n");
  EXPECT_NEAR(deg_from_rad(moves.moves[moves.moves.size() - 2].to[kC]), 90, 1e-9);
  EXPECT_NEAR(deg_from_rad(moves.moves.back().to[kC]), 7, 1e-9);
  test::Session session = cutter();
  session.moves("G21 G94 F1000\nTANGON\nG1 X0 Y10\nTANGOF\n#100=#<_c>\nM2\n");
  EXPECT_NEAR(session.parameters[100], 90, 1e-9);
}

// An edge behind the axis needs tool-centre-point control, which comes and goes with the knife.
TEST(Knife, AnEdgeThatTrailsIsKeptOnThePath) {
  const auto moves =
      cutter().moves("G21 G94 F1000\nG43 H3\nG0 X5\nTANGON\nG1 X20\nTANGOF\nG0 X0\nM2\n").moves;
  ASSERT_EQ(moves.size(), 3u);
  EXPECT_FALSE(moves[0].context.rtcp);
  EXPECT_TRUE(moves[1].context.rtcp);
  EXPECT_EQ(moves[1].context.tool_offset, Vec3(1, 0, 30));
  EXPECT_FALSE(moves[2].context.rtcp);
}

TEST(Knife, RefusesWhatWouldChangeADirectionByName) {
  const auto error = [](const std::string& program) {
    return cutter().error("G21 G94 F1000\nTANGON\n" + program);
  };
  EXPECT_EQ(error("G1 X10\nG4 P1\nG91 Y5\nG90\nM3 S100\n(MSG, on)\nTANGOF"), "");
  EXPECT_NE(error("G1 X10 C5")
                .find("p.ngc:3:8: a word C is not possible while the knife follows the path: it turns "
                      "by itself"),
            std::string::npos)
      << error("G1 X10 C5");
  for (const char* line : {"G43 H1", "G55", "G92 X0", "G18", "G20", "G28 X0", "G53 G0 X0", "G93", "G41.1 D2",
                           "M6", "G81 X1 Z-1 R1", "M70", "G68.2 X0 Y0 Z0 I0 J0 K0", "M428", "#1=#<_c>"}) {
    const std::string said = error(line);
    EXPECT_NE(said.find("p.ngc:3:"), std::string::npos) << line << ": " << said;
    EXPECT_NE(said.find("while the knife follows the path"), std::string::npos) << line << ": " << said;
    EXPECT_NE(said.find("TANGOF first"), std::string::npos) << line << ": " << said;
  }
  for (const char* before : {"G18", "G93", "G41.1 D2 G1 X10 Y10 F1000", "G68.2 X0 Y0 Z0 I0 J0 K0"})
    EXPECT_NE(cutter().error(fmt::format("G21 G94 F1000\n{}\nTANGON", before)).find("p.ngc:3:1:"),
              std::string::npos)
        << before;
  EXPECT_NE(test::cradle().error("TANGON").find("p.ngc:1:"), std::string::npos);
}

TEST(Knife, EndsWithTheProgram) {
  EXPECT_EQ(cutter().error("G21 G94 F1000\nTANGON\nG1 X10 Y10"), "");
  test::Session session = cutter();
  const auto moves = session.moves("G21 G94 F1000\nTANGON\nG1 X10 Y10\n").moves;  // no M2
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_NEAR(deg_from_rad(moves.back().to[kC]), 45, 1e-9);
}

}  // namespace
}  // namespace trn
