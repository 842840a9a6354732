#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "tests/app/session/machine_run.h"

// The mill whose spindle is an axis as well, on emulated CiA 402 drives: what the drive of C itself has done,
// from its feedback (the spindle's encoder), beside what the plan says.
namespace trn::test {
namespace {

struct Seen {
  std::uint32_t line = 0;
  bool on_path = false;
  double turns = 0, c_deg = 0, measured_deg = 0, x_mm = 0;
};

class Turns : public ReportSink {
 public:
  void write(const CycleReport& report) override {
    seen.push_back({report.line, report.on_path, report.spindle_turns, deg_from_rad(report.q_setpoint[3]),
                    deg_from_rad(report.q_measured[3]), report.q_setpoint[0]});
  }
  std::vector<Seen> seen;
};

struct Driven {
  SimulationResult result;
  std::vector<Seen> seen;
};

Driven driven(const std::string& text) {
  Assembly assembly = assemble(config_of("spindle_axis"));
  Parameters parameters;
  ToolTable tools;
  Turns turns;
  SimulationOptions options;
  options.program = written("spindle.ngc", text);
  options.trace = &turns;
  Driven out;
  out.result = simulate(assembly, parameters, tools, options);
  out.seen = turns.seen;
  return out;
}

TEST(SpindleAxisRuns, ItIsASpindleThenAnAxisThenASpindle) {
  const Driven run = driven(
      "G21 G90 G94 F600\nS1200 M3\nG1 X5\nM154\nG1 X20 C180 F2000\nG1 X0 C-90\nM155\nS600 M4\nG1 "
      "X5\nM5\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  ASSERT_FALSE(run.seen.empty());
  int as_spindle = 0, as_axis = 0, other_way = 0;
  for (std::size_t i = 1; i < run.seen.size(); ++i) {
    const Seen &now = run.seen[i], &before = run.seen[i - 1];
    // Behind a line's path the spindle changes over while its number still stands there.
    if (!now.on_path || now.line != before.line || now.x_mm == before.x_mm) continue;
    const double per_s = (now.turns - before.turns) / 0.002;
    if (now.line == 3) {
      EXPECT_NEAR(per_s, 20, 0.5);  // 1200 rpm, clockwise
      ++as_spindle;
    } else if (now.line == 9) {
      EXPECT_NEAR(per_s, -10, 0.5);
      ++other_way;
    } else if ((now.line == 5 || now.line == 6)) {
      // The drive stands where the plan has C, whole turns apart; clockwise is against C.
      EXPECT_NEAR(std::remainder(-360 * now.turns - now.measured_deg, 360), 0, 1e-6);
      EXPECT_NEAR(now.measured_deg, now.c_deg, 12);  // as far behind as the drive is
      ++as_axis;
    }
    if (now.line == 3 || now.line == 9) {
      EXPECT_NEAR(now.measured_deg, now.c_deg, 90);  // nobody sees the turns
    }
  }
  EXPECT_GT(as_spindle, 100);
  EXPECT_GT(as_axis, 100);
  EXPECT_GT(other_way, 40);
  EXPECT_NEAR(run.seen.back().c_deg, -90, 1e-9);
}

// Threads follow its encoder as they follow any other.
TEST(SpindleAxisRuns, AThreadFollowsIt) {
  const Driven run = driven("G21 G90 G94\nS600 M3\nG33 Z-10 K1\nM5\nM2\n");
  EXPECT_EQ(run.result.fault, Fault::kOk);
}

TEST(SpindleAxisRuns, AJointWithAnEndIsNoSpindle) {
  std::string text = text_of(config_of("mill"));
  try {
    assemble(written("no_spindle.toml", text + "\n[spindle_axis]\naxis = \"C\"\n"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("endless = true"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn::test
