#include "app/session/simulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/operator_script.h"
#include "core/config.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/support/paths.h"

// What a run says of itself, on programs whose answers are known.
namespace trn {
namespace {

SimulationResult run(const std::string& machine, const std::string& text, SimulationOptions options = {}) {
  Assembly assembly = assemble(source_dir() + "/configs/" + machine + ".toml");
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50\n", "t");
  options.program = "p.ngc";
  options.program_text = text;
  return simulate(assembly, parameters, tools, options);
}

/// A shipped machine with `edits`: texts of its config, and what stands in their place.
ConfigTable edited(const std::string& machine,
                   const std::vector<std::pair<std::string, std::string>>& edits) {
  const std::string path = source_dir() + "/configs/" + machine + ".toml";
  std::ifstream in(path);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const auto& [from, to] : edits)
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
  return parse_config(text, path);
}

SimulationResult run_edited(const ConfigTable& config, const std::string& text) {
  Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  SimulationOptions options;
  options.program = "p.ngc";
  options.program_text = text;
  return simulate(assembly, parameters, tools, options);
}

/// Why the drives do not come up, and how much processor time it took to know.
std::string why_not_up(const ConfigTable& config, double* took_s = nullptr) {
  const std::clock_t before = std::clock();
  std::string out;
  try {
    run_edited(config, "G21 G90\nG0 X1\nM2\n");
  } catch (const ConfigError& error) {
    out = error.what();
  }
  if (took_s) *took_s = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  return out;
}

TEST(Simulation, NamesTheSafetyInputThatKeepsTheDrivesOff) {
  const std::string input = "[[safety.input]]\nkind = \"emergency_stop\"\nfrom = \"io.input.5\"\n";
  const auto config = [&](const std::string& more) {
    return edited("mill", {{"[io]\n", input + more + "\n[io]\n"}});
  };
  double took_s = 0;
  const std::string off = why_not_up(config(""), &took_s);
  EXPECT_NE(off.find("emergency_input: io.input.5 is off, safe_when = \"on\""), std::string::npos) << off;
  EXPECT_NE(off.find("[[io.script]] with at_s = 0, input = 5, value = 1 turns it on"), std::string::npos)
      << off;
  EXPECT_LT(took_s, 2) << "nothing changes any more after two seconds of the machine";
  EXPECT_EQ(why_not_up(config("safe_when = \"off\"\n")), "");
  const std::string door = "[[safety.input]]\nkind = \"enable\"\nfrom = \"drive.Y.input.4\"\n";
  const std::string drive = why_not_up(edited("cradle_can", {{"[drives]\n", door + "\n[drives]\n"}}));
  EXPECT_NE(drive.find("enable_off: drive.Y.input.4 is off"), std::string::npos) << drive;
  EXPECT_NE(drive.find("turns it on where inputs_on lists 4"), std::string::npos) << drive;
}

TEST(Simulation, NamesTheJointWhoseHomingFailsAndWhy) {
  double took_s = 0;
  const std::string maker =
      why_not_up(edited("cradle_can", {{"homing_method = 5", "homing_method = -3"}}), &took_s);
  EXPECT_NE(maker.find("-3 is the maker's own homing method"), std::string::npos) << maker;
  const std::string index = why_not_up(
      edited("cradle_can", {{"homing_method = 5", "homing_method = 34"},
                            {"counts_per_mm = 10000", "counts_per_mm = 10000\nindex_speed_mm_s = 100"},
                            {"[[drives.bus]]", "[drives.emulation]\nindex_pitch_mm = 900\n[[drives.bus]]"}}));
  EXPECT_NE(index.find("homing does not end ("), std::string::npos) << index;
  EXPECT_NE(index.find("fault homing_failed: joint X"), std::string::npos) << index;
  EXPECT_NE(index.find("came to a limit switch before it found an index"), std::string::npos) << index;
}

TEST(Simulation, SaysThatASearchTookTooLong) {
  const std::string slow = why_not_up(
      edited("cradle_can", {{"homing_method = 5", "homing_method = 34"},
                            {"[[drives.bus]]", "[drives.emulation]\nindex_pitch_mm = 900\n[[drives.bus]]"}}));
  EXPECT_NE(slow.find("searched for longer than homing_timeout_s"), std::string::npos) << slow;
}

// The first sample of a motion lies a whole period behind its beginning: 5 mm at 50 mm/s.
TEST(Simulation, LongPeriodsAreFollowedAsShortOnesAre) {
  for (const char* period : {"0.01", "0.05", "0.1"}) {
    const ConfigTable config = edited("mill", {{"period_s = 0.001", std::string("period_s = ") + period}});
    for (const char* text :
         {"G21 G90\nG0 X-1\nM2\n", "G21 G90 G64 P0.01\nG1 X-100 Y100 F3000\nY0\nX-50\nM2\n",
          "G21 G90\nG0 X200 Y-100\nX0 Y0\nM2\n"}) {
      const SimulationResult result = run_edited(config, text);
      EXPECT_EQ(result.fault, Fault::kOk) << period << "\n" << text;
      EXPECT_EQ(result.deviation.tip_over_mm.value, 0) << period << "\n" << text;
      EXPECT_TRUE(result.within_limits) << period << "\n" << text;
    }
  }
}

// A dwell of 45 s has 45,000 periods of a millisecond.
TEST(Simulation, TellsItsProgressEveryTwentyThousandPeriods) {
  std::vector<double> told_s;
  std::vector<std::uint32_t> lines;
  SimulationOptions options;
  options.progress = [&](std::uint32_t line, double time_s) {
    lines.push_back(line);
    told_s.push_back(time_s);
  };
  const SimulationResult result = run("mill", "G21 G94\nG4 P45\nM2\n", options);
  EXPECT_NEAR(result.cycle_time_s, 45, 0.01);
  ASSERT_EQ(told_s.size(), 2u);
  EXPECT_NEAR(told_s[0], 20, 0.002);
  EXPECT_NEAR(told_s[1], 40, 0.002);
  EXPECT_EQ(lines, (std::vector<std::uint32_t>{2, 2}));
}

// 30 mm at 600 mm/min take 3 s, and a little for the ramps at either end.
TEST(Simulation, AStraightCutTakesItsTimeAndItsWay) {
  const std::clock_t before = std::clock();
  const SimulationResult result = run("mill", "G21 G90 G94\nG1 X30 F600\nM2\n");
  EXPECT_GT(result.planning_s, 0);
  EXPECT_LE(result.planning_s, static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC)
      << "planning is a part of what this process did";
  EXPECT_LE(result.path_mm, 30);
  EXPECT_GT(result.path_mm, 30 - 1e-3) << "but for the first period";
  EXPECT_GT(result.cycle_time_s, 3);
  EXPECT_LT(result.cycle_time_s, 3 + 0.12);
  EXPECT_TRUE(result.within_limits);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_EQ(result.lines, 3u);
  EXPECT_EQ(result.starvations, 0u);
  EXPECT_LE(result.joints[0].peak(Quantity::kVelocity).value, 10 + 1e-9);
  EXPECT_GT(result.joints[0].peak(Quantity::kVelocity).value, 9.9);
  EXPECT_EQ(result.joints[1].peak(Quantity::kVelocity).value, 0);
}

// The measured cradle's errors are some hundredths of a millimetre; a program that goes nowhere near its
// tables' ends cannot ask for more than a tenth.
TEST(Simulation, SumsUpWhatEachCorrectionDid) {
  EXPECT_TRUE(run("mill", "G21 G90 G94\nG1 X30 F6000\nM2\n").corrections.empty());
  const SimulationResult result = run("cradle_measured", "G21 G90 G94\nG1 X50 Y40 A20 C30 F6000\nM2\n");
  ASSERT_GE(result.corrections.size(), 1u);
  const CorrectionSummary& geometric = result.corrections[0];
  EXPECT_EQ(geometric.name, "geometric");
  EXPECT_GT(geometric.peak_mm, 0);
  EXPECT_LT(geometric.peak_mm, 0.2);
  EXPECT_LT(geometric.peak_rad, 0.01);
  EXPECT_LT(geometric.left_tip_mm, 1e-6);
}

/// The greatest offset of each correction behind the plan, in any linear joint.
class GreatestOffsets final : public ReportSink {
 public:
  void write(const CycleReport& report) override {
    for (std::size_t i = 0; i < 2; ++i)
      mm[i] = std::max(mm[i], report.corrections[i].offset.size() < 3
                                  ? 0.0
                                  : report.corrections[i].offset.head<3>().lpNorm<Eigen::Infinity>());
  }
  std::array<double, 2> mm{};
};

// Ten minutes at full speed warm a screw by some micrometres.
TEST(Simulation, SumsUpTheCorrectionsBehindThePlanToo) {
  GreatestOffsets seen;
  SimulationOptions options;
  options.trace = &seen;
  std::string program = "G21 G90 G94 F10000\n";
  for (int i = 0; i < 20; ++i) program += i % 2 ? "G1 X0\n" : "G1 X100\n";
  const SimulationResult result = run("head_screws", program + "M2\n", options);
  ASSERT_GE(result.corrections.size(), 1u);
  EXPECT_GT(result.corrections.back().peak_mm, 0);
  EXPECT_EQ(result.corrections.back().peak_mm, std::max(seen.mm[0], seen.mm[1]));
}

// At the end of the script nobody is left who could wake a machine that stands: the run waits ten seconds,
// says so and ends. While the script still has something to do, it waits for that.
TEST(Simulation, EndsWhereTheScriptLeavesTheMachineStanding) {
  const std::string program = "G21 G90 G94\nG1 X30 F600\nX60\nM2\n";
  for (const std::string text : {"0.5 hold\n", "0.5 step on\n", "0.5 override 0\n"}) {
    SCOPED_TRACE(text);
    std::vector<std::string> warnings;
    SimulationOptions options;
    options.on_warning = [&](const Diagnostic& warning) { warnings.push_back(warning.text); };
    options.script = parse_operator_script(text, "s");
    const SimulationResult left = run("mill", program, options);
    const double stands_s =
        text == "0.5 step on\n" ? 3 : 0.5;  // at the end of the first line, 30 mm at 10 mm/s
    EXPECT_NEAR(left.cycle_time_s, stands_s + 10, 1);
    EXPECT_EQ(left.stopped_at, std::optional<std::uint32_t>(2));
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_NE(warnings[0].find("the operator's script has nothing more to do"), std::string::npos)
        << warnings[0];

    warnings.clear();
    options.script = parse_operator_script(text + "20 override 100\n20 step off\n20 resume\n", "s");
    const SimulationResult woken = run("mill", program, options);
    EXPECT_NEAR(woken.cycle_time_s, 6 + 20 - stands_s, 1);
    EXPECT_FALSE(woken.stopped_at);
    EXPECT_TRUE(warnings.empty());
  }
}

}  // namespace
}  // namespace trn
