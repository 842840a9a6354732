#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "core/frames.h"
#include "tests/app/session/machine_run.h"
#include "tests/support/rounds.h"

// Programs on every machine, through the whole kernel.
namespace trn::test {
namespace {

TEST(Head, TheTipStandsWhileTheAxesMoveByTheToolsSwing) {
  // N73 to N75 of docs/sources.md S2: A and C alone, tool 1 is 50 mm long
  const MachineRun run =
      run_text(config_of("head"),
               "G21 G90 G94 G61\nT1 M6\nG43.4 H1\nG0 X76.281 Y59.637 Z14.12 A22.18 C40.96\n"
               "N73 G1 X76.281 Y59.637 Z14.12 A22.18 C40.96 F600\n"
               "N74 X76.281 Y59.637 Z14.12 A21.62 C41.63\n"
               "N75 X76.281 Y59.637 Z14.12 A20.68 C42.19\nM2\n");
  expect_true_tips("head", run, 50);
  const auto axis = [](double a_deg, double c_deg) {
    const double a = rad_from_deg(a_deg), c = rad_from_deg(c_deg);
    return Vec3(std::sin(c) * std::sin(a), -std::cos(c) * std::sin(a), std::cos(a));
  };
  const Vec3 tip(76.281, 59.637, 14.12);
  const Sample *first = nullptr, *last = nullptr;
  for (const Sample& s : run.samples) {
    if (s.line < 6) continue;
    if (!first) first = &s;
    last = &s;
    EXPECT_LT((s.p_W - tip).norm(), 1e-9);
  }
  ASSERT_TRUE(first && last);
  const Vec3 start = tip + 50 * axis(22.18, 40.96), end = tip + 50 * axis(20.68, 42.19);
  EXPECT_LT((last->q.head<3>() - end).norm(), 1e-9);
  EXPECT_LT((first->q.head<3>() - start).norm(), 0.05);  // the first sample is on its way
  EXPECT_GT((end - start).norm(), 1.0);
  EXPECT_LT((last->q.head<3>() - start - 50 * (axis(20.68, 42.19) - axis(22.18, 40.96))).norm(), 1e-9);
}

std::vector<std::string> shipped_machines() {
  std::vector<std::string> names;
  for (const std::string& path : shipped_configs())
    if (const std::string name = std::filesystem::path(path).stem().string();
        name.find("_can") == std::string::npos && name.find("_measured") == std::string::npos &&
        name.find("_screws") == std::string::npos && name.find("_modbus") == std::string::npos &&
        name.find("_servo") == std::string::npos)  // the judge here knows true geometry at one temperature
      names.push_back(name);                       // only, and has no bus
  return names;
}

class EveryMachineRuns : public testing::TestWithParam<std::string> {};

// A square with a circle in it, 10 mm to either side of home, as any 3-axis program would have it: the tool
// draws it on the work, unmirrored, on a table that moves as well as under a tool that moves.
TEST_P(EveryMachineRuns, AThreeAxisProgramDrawsWhatItSays) {
  const MachineRun run =
      run_text(config_of(GetParam()),
               "G21 G17 G90 G94 G64 P0.01\nG92.1\nG91 G1 F1200 X10\nY-5\nX-10 Z-4\nY5 Z4\nG2 X6 Y0 I3 "
               "J0\nM2\n");
  ASSERT_FALSE(run.samples.empty());
  const Vec3 start = run.start.p_W;
  const auto at_end_of = [&](std::uint32_t line) {
    Vec3 out = Vec3::Constant(1e9);
    for (const Sample& s : run.samples)
      if (s.line == line) out = s.p_W;
    return Vec3(out - start);
  };
  EXPECT_LT((at_end_of(7) - Vec3(6, 0, 0)).norm(), 1e-9);
  EXPECT_LT((at_end_of(3) - Vec3(10, 0, 0)).norm(), 0.5);  // the corner is rounded by 0.01
  EXPECT_LT((at_end_of(5) - Vec3(0, -5, -4)).norm(), 0.5);
  double highest = -1e9;
  for (const Sample& s : run.samples)
    if (s.line == 7) highest = std::max(highest, (s.p_W - start).y());
  EXPECT_NEAR(highest, 3, 1e-3);  // clockwise: over the top
  EXPECT_LT(run.result.deviation.tip_ratio.value, 1.0);
}

// The soft limits are judged in the joints along the whole path before anything moves, and the line is named.
TEST_P(EveryMachineRuns, AProgramThatLeavesTheRangeIsRefusedWithItsLine) {
  const std::string message =
      error_of(config_of(GetParam()), "G21 G90 G94\nG91\nG1 F1000 X1\nG1 X5000\nM2\n");
  EXPECT_NE(message.find("program.ngc:4"), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(Configs, EveryMachineRuns, testing::ValuesIn(shipped_machines()),
                         [](const auto& each) { return each.param; });

TEST(RailMillRuns, ATiltAboutAnotherAxisIsRefusedByName) {
  for (const char* word : {"B", "C"}) {
    const std::string message =
        error_of(config_of("rail_mill"), fmt::format("G21 G90 G94\nG1 F100 {}5\nM2\n", word));
    EXPECT_NE(message.find("program.ngc:2"), std::string::npos) << message;
    EXPECT_NE(message.find(fmt::format("no {} axis", word)), std::string::npos) << message;
  }
  const MachineRun run = run_text(config_of("rail_mill"), "G21 G90 G94\nG1 F1000 A5\nA-5\nM2\n");
  EXPECT_LT((run.samples.back().u_B - rot_x(rad_from_deg(-5)).col(2)).norm(), 1e-12);
}

TEST(RailMillRuns, ReachAndConditioningAreJudgedBeforeAnythingMoves) {
  const std::string down = error_of(config_of("rail_mill"), "G21 G90 G94\nG1 F1000 Z-700\nM2\n");
  EXPECT_NE(down.find("program.ngc:2"), std::string::npos) << down;
  EXPECT_TRUE(down.find("unreachable") != std::string::npos || down.find("singular") != std::string::npos)
      << down;
}

// Between two good ends a straight line may pass a place that cannot be. With the table high, the hexapod
// stands well beside the middle but in it its legs would be sqrt(178^2 + 430^2) = 465 mm, short of their 480.
TEST(HexapodRuns, TheMiddleOfAMoveIsJudgedToo) {
  const std::string ends = "G21 G90 G94 F3000\nG1 X405\nZ270\n";
  EXPECT_EQ(error_of(config_of("hexapod"), ends + "M2\n"), "no error");
  EXPECT_EQ(error_of(config_of("hexapod"), "G21 G90 G94 F3000\nG1 X-405\nZ270\nM2\n"), "no error");
  const std::string across = error_of(config_of("hexapod"), ends + "X-405\nM2\n");
  EXPECT_NE(across.find("program.ngc:4"), std::string::npos) << across;
  EXPECT_NE(across.find("outside its range 480"), std::string::npos) << across;
}

struct Difference {
  double tip_mm = 0, axis_rad = 0;
};

/// How far every tenth tip of `of` is from the path of `to` on the same line of the program; and how far the
/// axes are apart there, where the tool is in the block (below z_cut), not on its way.
Difference difference(const MachineRun& of, const MachineRun& to, double z_cut) {
  std::map<std::uint32_t, std::vector<const Sample*>> lines;
  for (std::size_t i = 0; i < to.samples.size(); ++i) {  // a line's samples, and those before and after
    const Sample* s = &to.samples[i];
    if (i > 0 && s[-1].line != s->line) {
      lines[s->line].push_back(s - 1);
      lines[s[-1].line].push_back(s);
    }
    lines[s->line].push_back(s);
  }
  Difference out;
  for (std::size_t n = 0; n < of.samples.size(); n += 10) {
    const Sample& s = of.samples[n];
    const std::vector<const Sample*>& path = lines[s.line];
    double best = 1e9, angle = 0;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Vec3 way = path[i + 1]->p_W - path[i]->p_W;
      if (way.squaredNorm() > 1) continue;  // the line was left here, and came back elsewhere
      const double share = way.squaredNorm() > 0
                               ? std::clamp((s.p_W - path[i]->p_W).dot(way) / way.squaredNorm(), 0.0, 1.0)
                               : 0.0;
      const double d = (path[i]->p_W + share * way - s.p_W).norm();
      if (d >= best) continue;
      best = d;
      angle = path[i]->u_W.cross(s.u_W).norm();
    }
    out.tip_mm = std::max(out.tip_mm, best);
    if (s.p_W.z() < z_cut) out.axis_rad = std::max(out.axis_rad, angle);
  }
  return out;
}

/// The run from the first tilted plane to the last, without the tool change between: what every machine does.
MachineRun tilted_part(const std::string& machine, const std::string& program) {
  const std::string text = text_of(program);
  const auto line_of = [&](std::size_t at) {
    return static_cast<std::uint32_t>(1 +
                                      std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
  };
  const std::uint32_t pocket = line_of(text.find("G68.2 X")), change = line_of(text.find("T3 M6"));
  const std::uint32_t body = line_of(text.find("o100 endsub")), end = line_of(text.rfind("G69"));
  const MachineRun whole = run_file(config_of(machine), program);
  EXPECT_LT(whole.result.deviation.tip_ratio.value, 1.0);
  EXPECT_LT(whole.result.deviation.axis_ratio.value, 1.0);
  MachineRun out;
  for (const Sample& s : whole.samples)
    if (s.line < body || (s.line > pocket && s.line < end && (s.line < change || s.line > change + 4)))
      out.samples.push_back(s);
  return out;
}

// One program, no rotary word in it, on machines that tilt by four different pairs of axes: the same part.
TEST(OneProgram, MakesTheSamePartOnEveryMachineThatTilts) {
  const std::string program = source_dir() + "/examples/tilted_pocket.ngc";
  const MachineRun cradle = tilted_part("cradle", program);
  ASSERT_GT(cradle.samples.size(), 10000u);
  std::vector<const char*> others{"head", "hexapod"};
  if (test::long_form()) others.insert(others.end(), {"head_table", "nutating"});
  for (const char* name : others) {
    SCOPED_TRACE(name);
    const MachineRun other = tilted_part(name, program);
    for (const Difference& d : {difference(cradle, other, 4), difference(other, cradle, 4)}) {
      EXPECT_LT(d.tip_mm, 0.01);  // G64 P0.01
      EXPECT_LT(d.axis_rad, rad_from_deg(0.05));
      RecordProperty(std::string(name) + "_tip_mm", fmt::format("{:.2g}", d.tip_mm));
    }
  }
}

}  // namespace
}  // namespace trn::test
