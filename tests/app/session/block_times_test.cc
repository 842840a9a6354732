#include "tests/app/session/block_times.h"

#include <fmt/format.h>

#include <random>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/app/session/machine_run.h"
#include "tests/support/rounds.h"

// A block takes the time that its feed asks for, or longer, and hardly longer where no joint is near a limit:
// G93, G94 and G95 on every machine with rotary axes, in every path mode, with and without RTCP.
namespace trn {
namespace {

using test::BlockTime;
using test::BlockTimes;

class Watch : public ReportSink {
 public:
  explicit Watch(const Assembly& assembly) : times(assembly.machine, *assembly.map, *assembly.kinematics) {}
  void write(const CycleReport& report) override { times.sample(report); }
  BlockTimes times;
};

std::vector<BlockTime> times_of(const std::string& machine, const std::string& text) {
  Assembly assembly = assemble(test::config_of(machine));
  Parameters parameters;
  ToolTable tools;
  Watch watch(assembly);
  SimulationOptions options;
  options.program = "times.ngc";
  options.program_text = text;
  options.trace = &watch;
  options.on_move = [&](const ProgramMove& move) { watch.times.programmed(move); };
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  EXPECT_TRUE(result.within_limits) << machine << "\n" << text;
  EXPECT_TRUE(watch.times.clock().complete()) << machine << "\n" << text;
  return watch.times.clock().blocks();
}

// Where a curve passes a vertex early or late by a share of the tolerance, so is the border; a period is what
// can be seen. A feed per minute or per turn is the tip's speed, so its time is that of the way which the tip
// was driven: beside a rotary word that turns by degrees, a border on the tip's way is known less well.
void expect_programmed(const std::vector<BlockTime>& blocks, double period_s, const std::string& what) {
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const BlockTime& b = blocks[i];
    if (b.programmed_s <= 0) continue;
    const double unsure = 0.005 + 0.2 * b.tolerance / b.length;
    const double wanted_s = b.inverse_time || b.feed_mm_s <= 0 ? b.programmed_s : b.driven_mm / b.feed_mm_s;
    EXPECT_GE(b.driven_s, wanted_s * (1 - unsure) - 0.1 * period_s) << what << "line " << b.line;
    double worst = 0;
    for (std::size_t k = i > 0 ? i - 1 : 0; k < std::min(i + 2, blocks.size()); ++k)
      worst = std::max(worst, blocks[k].worst);
    if (worst > 0.5 || i == 0 || i + 1 == blocks.size()) continue;
    EXPECT_LE(b.driven_s, wanted_s * (1.02 + unsure) + 0.1 * period_s) << what << "line " << b.line;
  }
}

struct Case {
  const char *machine, *rotary, *rtcp;
};

constexpr Case kCases[] = {{"cradle", "C", "M428"},     {"head", "C", "M428"},
                           {"head_table", "C", "M428"}, {"cradle_measured", "C", "M428"},
                           {"hexapod", "A", "M428"},    {"cradle", "C", "M429"},
                           {"head", "C", "M429"},       {"head_table", "C", "M429"}};

// Forty blocks whose way, turn and time change from one to the next.
std::string pass(const Case& c, const std::string& modes, std::mt19937_64& rng) {
  const auto u = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(rng);
  };
  const double step = std::exp(u(-2, 0.3)), turn = std::string(c.rotary) == "A" ? 0.2 : u(0.2, 3),
               feed = u(1, 6);
  std::string out = fmt::format("G21 G90 {}\nG4 P0.01\n{}\n", c.rtcp, modes);
  double x = 0, angle = 0;
  for (int i = 0; i < 40; ++i) {
    const double way = step * u(0.6, 1.4);
    x += way;
    angle += turn * std::sin(x);
    out += fmt::format("G1 X{:.6f} Y{:.6f} {}{:.6f} F{:.6f}\n", x, 0.5 * std::sin(x), c.rotary, angle,
                       modes.find("G93") != std::string::npos   ? 60 * feed / way
                       : modes.find("G95") != std::string::npos ? 60 * feed / 300
                                                                : 60 * feed);
  }
  return out + "M2\n";
}

TEST(ProgrammedTime, IsTakenByEveryBlock) {
  for (int round = 0; round < test::rounds(1); ++round)
    for (const Case& c : kCases)
      for (const char* modes : {"G93 G64 P0.01", "G93 G61", "G94 G64 P0.01", "G95 S300 M3 G64 P0.02"}) {
        std::mt19937_64 rng(static_cast<std::uint64_t>(round));
        const std::string text = pass(c, modes, rng);
        expect_programmed(times_of(c.machine, text), 0.002, std::string(c.machine) + "\n" + text);
        if (testing::Test::HasFailure()) return;
      }
}

TEST(ProgrammedTime, OfShortBlocksThatOneCurveStandsFor) {
  for (const char* machine : {"cradle", "head", "head_table"})
    for (const double degrees : {1.0, 3.0}) {
      std::string text = "G21 G90 G64 P0.01\nG0 X1 Z40\nG4 P0.1\nG93\n";
      for (int i = 1; i <= 40; ++i)
        text += fmt::format("G1 X{:.1f} C{:.0f} F300\n", 1 + 0.1 * i, degrees * i);
      double driven_s = 0;
      for (const BlockTime& block : times_of(machine, text + "M2\n"))
        if (block.inverse_time) driven_s += block.driven_s;
      EXPECT_GE(driven_s, 8.0) << machine;
      EXPECT_LE(driven_s, 8.5) << machine;
    }
}

}  // namespace
}  // namespace trn
