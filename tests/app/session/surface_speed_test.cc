#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "tests/app/session/machine_run.h"

// Constant surface speed (G96) on the mill, as if its work turned about a Z at X0: what the spindle was told
// in every period, and how fast the tip went, beside S / (2 pi r) and F times that.
namespace trn::test {
namespace {

constexpr double kPeriod = 0.001;

struct Period {
  std::uint32_t line = 0;
  double x_mm = 0, z_mm = 0, rpm = 0;
  bool on_path = false;
};

class Periods : public ReportSink {
 public:
  void write(const CycleReport& report) override {
    seen.push_back(
        {report.line, report.q_setpoint[0], report.q_setpoint[2], report.spindle_rpm, report.on_path});
  }
  std::vector<Period> seen;
};

struct Turned {
  SimulationResult result;
  std::vector<Period> seen;
};

Turned turned(const std::string& text) {
  Assembly assembly = assemble(config_of("mill"));
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50 X+3 D6\n", "t.tbl");
  Periods periods;
  SimulationOptions options;
  options.program = written("turned.ngc", text);
  options.trace = &periods;
  Turned out;
  out.result = simulate(assembly, parameters, tools, options);
  out.seen = periods.seen;
  EXPECT_EQ(out.result.fault, Fault::kOk);
  EXPECT_TRUE(out.result.within_limits);
  return out;
}

// Of a surface that shall pass at v m/min, the work turning about x0.
double rpm_for(double metres_min, double rpm_max, double radius_mm) {
  return std::min(rpm_max, metres_min * 1000 / (2 * kPi * std::abs(radius_mm)));
}

// The spindle in all periods of a line, and the time that the line took.
double expect_speeds(const Turned& run, std::uint32_t line, double metres_min, double rpm_max,
                     double x0 = 0) {
  double time_s = 0;
  for (const Period& now : run.seen) {
    if (now.line != line || !now.on_path) continue;
    const double wanted = rpm_for(metres_min, rpm_max, now.x_mm - x0);
    EXPECT_NEAR(now.rpm, wanted, 0.006 * wanted) << "x " << now.x_mm;
    time_s += kPeriod;
  }
  return time_s;
}

// Of F mm a turn from one radius to another: the integral of 60 / (F rpm(r)), by the middle rule.
double time_of(double feed, double metres_min, double rpm_max, double from, double to) {
  constexpr int kParts = 100'000;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const double r = from + (to - from) * (i + 0.5) / kParts;
    sum += 60 / (feed * rpm_for(metres_min, rpm_max, r));
  }
  return sum * std::abs(to - from) / kParts;
}

TEST(SurfaceSpeedRuns, AFaceIsCutAtOneSpeed) {
  const Turned run = turned("G18 G21 G90 G94\nG0 X40 Z0\nG96 D2000 S150 M3\nG95 F0.25\nG1 X2\nM5\nM2\n");
  const double took = expect_speeds(run, 5, 150, 2000);
  const double wanted = time_of(0.25, 150, 2000, 40, 2);
  EXPECT_NEAR(took, wanted, 0.02 * wanted);
  EXPECT_EQ(run.seen.back().rpm, 0);
}

// The chip is as thick at every radius: the tip goes F a turn, on lines as on arcs, away from the ends where
// it speeds up.
TEST(SurfaceSpeedRuns, TheFeedATurnFollowsTheSpeed) {
  for (const std::string cut : {"G1 X60", "G1 X60 Z20", "G3 X50 Z40 I0 K40", "G2 X50 Z40 I40 K0"}) {
    const Turned run =
        turned("G18 G21 G90 G94 G64 P0.01\nG0 X10 Z0\nG96 D3000 S120 M4\nG95 F0.3\n" + cut + "\nM2\n");
    int looked = 0;
    for (std::size_t i = 200; i + 200 < run.seen.size(); ++i) {
      const Period &now = run.seen[i], &before = run.seen[i - 1];
      if (run.seen[i - 200].line != 5 || run.seen[i + 200].line != 5 || !run.seen[i + 200].on_path) continue;
      const double per_turn =
          std::hypot(now.x_mm - before.x_mm, now.z_mm - before.z_mm) / kPeriod / (std::abs(now.rpm) / 60);
      EXPECT_NEAR(per_turn, 0.3, 0.3 * 0.035) << cut << " at x " << now.x_mm;
      EXPECT_LT(now.rpm, 0) << "M4";
      ++looked;
    }
    EXPECT_GT(looked, 1000) << cut;
  }
}

// X0 is where the work turns: the work offset and the tool's X say where that is. Feet a minute with G20.
TEST(SurfaceSpeedRuns, CountsFromTheProgramsX0) {
  const Turned offset =
      turned("G18 G21 G90\nG10 L2 P1 X100\nG0 X20 Z0\nG96 D2500 S100 M3\nG1 X40 F600\nM2\n");
  EXPECT_GT(expect_speeds(offset, 5, 100, 2500, 100), 1);
  const Turned tool = turned("G18 G21 G90\nT1 M6\nG43\nG0 X20 Z60\nG96 D2500 S100 M3\nG1 X40 F600\nM2\n");
  EXPECT_GT(expect_speeds(tool, 6, 100, 2500, 3), 1);
  const Turned feet = turned("G18 G20 G90\nG0 X1 Z0\nG96 D2500 S300 M3\nG1 X2 F20\nG97 S500\nG1 X1\nM2\n");
  EXPECT_GT(expect_speeds(feet, 4, 300 * 0.3048, 2500), 1);
  for (const Period& now : feet.seen) EXPECT_TRUE(now.line != 6 || !now.on_path || now.rpm == 500) << "G97";
}

// Moved while it turns, as between the parts of a bar, it is told at once.
TEST(SurfaceSpeedRuns, AnotherOffsetIsAnotherAxis) {
  const Turned run = turned(
      "G18 G21 G90\nG10 L2 P2 X50\nG0 X20 Z0\nG96 D2500 S100 M3\nG1 X30 F600\nG55\nG1 X40\nG92 X10\nG1 "
      "X25\nM2\n");
  EXPECT_GT(expect_speeds(run, 5, 100, 2500, 0), 0.5);
  EXPECT_GT(expect_speeds(run, 7, 100, 2500, 50), 0.5);
  EXPECT_GT(expect_speeds(run, 9, 100, 2500, 80), 0.5);
}

// A rapid from far away ends where the work turns slowly; the cut begins when it turns fast.
TEST(SurfaceSpeedRuns, ACutWaitsForTheSpindleBehindARapid) {
  Assembly assembly = assemble(written("slow_spindle.toml", [] {
    std::string text = text_of(config_of("mill"));
    const std::string fast = "acceleration_rpm_s = 3000.0";
    return text.replace(text.find(fast), fast.size(), "acceleration_rpm_s = 500");
  }()));
  Parameters parameters;
  ToolTable tools;
  Periods periods;
  SimulationOptions options;
  options.program =
      written("rapid.ngc", "G18 G21 G90\nG0 X90 Z0\nG96 D2000 S150 M3\nG0 X12\nG1 X11 F100\nM2\n");
  options.trace = &periods;
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  EXPECT_EQ(result.fault, Fault::kOk);
  // From 265 to 1989 rpm at 500 rpm/s: 3.4 s, of which the rapid itself takes less than one.
  double stood_s = 0;
  for (const Period& now : periods.seen) stood_s += std::abs(now.x_mm - 12) < 1e-9 ? kPeriod : 0;
  EXPECT_GT(stood_s, 2.4);
  EXPECT_LT(stood_s, 3.6);
}

}  // namespace
}  // namespace trn::test
