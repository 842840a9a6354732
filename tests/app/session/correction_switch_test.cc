#include <gtest/gtest.h>

#include <map>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/config.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "tests/app/session/machine_run.h"
#include "tests/compensation/true_machine.h"

// Corrections switched by M codes: in block order, smoothly, and only until the program's end.
namespace trn {
namespace {

using test::config_of;
using test::cradle;
using test::measured_pige;
using test::text_of;
using test::TipAxis;
using test::written;

constexpr char kProgram[] =
    "G21 G90 G94 G61 F3000\n"   // 1
    "G0 X20 Y10 Z60 A30 C20\n"  // 2
    "M428\n"                    // 3
    "G1 X30\n"                  // 4: on
    "M422\n"                    // 5
    "G1 X40 Y30 A40\n"          // 6: off
    "M422\n"                    // 7
    "G1 X20 C40\n"              // 8: off
    "M421\n"                    // 9
    "G1 X10 Y0 A20\n"           // 10: on
    "G1 X50 Y20\n"              // 11: on
    "M429\nM422\nG1 Y30\nM421\nG1 Y0\nM2\n";

/// Tip error of every line of kProgram against the words of the plan.
class LineMeter final : public ReportSink {
 public:
  void write(const CycleReport& report) override {
    if (!report.on_path || !report.context.rtcp) return;
    const TipAxis is = cradle(measured_pige(), report.q_setpoint, report.context.tool_offset);
    double& worst = worst_mm[report.line];
    worst = std::max(worst, (is.tip - report.y.head<3>()).norm());
    double& least = least_mm.try_emplace(report.line, 1e9).first->second;
    least = std::min(least, (is.tip - report.y.head<3>()).norm());
  }
  std::map<std::uint32_t, double> worst_mm, least_mm;
};

SimulationResult run_with(const std::string& config, const std::string& program, ReportSink& sink,
                          std::uint32_t from_line = 0) {
  Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  SimulationOptions options;
  options.program = program;
  options.trace = &sink;
  options.from_line = from_line;
  return simulate(assembly, parameters, tools, options);
}

TEST(CorrectionSwitch, ActsInBlockOrderInsideThePlan) {
  LineMeter meter;
  const SimulationResult result =
      run_with(config_of("cradle_measured"), written("switch.ngc", kProgram), meter);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  for (const std::uint32_t line : {4u, 10u, 11u}) EXPECT_LT(meter.worst_mm.at(line), 1e-6) << line;
  for (const std::uint32_t line : {6u, 8u}) EXPECT_GT(meter.least_mm.at(line), 0.01) << line;
  EXPECT_LT(result.deviation.tip_exact_mm.value, 1e-6);
}

TEST(CorrectionSwitch, HoldsWhereAProgramBeginsFurtherDown) {
  LineMeter meter;
  const SimulationResult result =
      run_with(config_of("cradle_measured"), written("switch.ngc", kProgram), meter, 8);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_GT(meter.least_mm.at(8), 0.01);
  EXPECT_LT(meter.worst_mm.at(10), 1e-6);
}

TEST(CorrectionSwitch, OffAtStartCanBeSwitchedOn) {
  std::string text = text_of(config_of("cradle_measured"));
  text.replace(text.find("enabled = true"), 14, "enabled = false");
  LineMeter meter;
  const SimulationResult result = run_with(written("off.toml", text), written("switch.ngc", kProgram), meter);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  EXPECT_GT(meter.least_mm.at(4), 0.01);
  EXPECT_LT(meter.worst_mm.at(10), 1e-6);
}

constexpr char kTables[] = R"(
[corrections.joint_table]
m_on = "M431"
m_off = "m432"
limit_mm = 0.05
[[corrections.joint_table.joint]]
joint = "X"
slope = 0.002
backlash_mm = 0.02
)";

struct Offsets final : ReportSink {
  void write(const CycleReport& report) override {
    if (report.on_path && report.speed_mm_s > 1)
      last[report.line] = {(report.q_plan[0] - report.y[0]) / report.y[0], report.corrections[0].offset[0]};
    end = report;
  }
  std::map<std::uint32_t, std::pair<double, double>> last;  ///< slope, backlash
  CycleReport end;
};

TEST(CorrectionSwitch, TablesAndBacklashGoTogetherAndComeBackAfterTheProgram) {
  Offsets offsets;
  const std::string program = written(
      "tables.ngc", "G21 G90 G94 G61 F6000\nG1 X100\nM432\nG1 X200\nM431\nG1 X300\nM432\nG1 X250\nM2\n");
  const SimulationResult result =
      run_with(written("tables.toml", text_of(config_of("cradle")) + kTables), program, offsets);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  EXPECT_NEAR(offsets.last.at(2).first, 0.002, 1e-12);
  EXPECT_NEAR(offsets.last.at(2).second, 0.01, 1e-4);
  EXPECT_NEAR(offsets.last.at(4).first, 0, 1e-12);
  EXPECT_NEAR(offsets.last.at(4).second, 0, 1e-5);
  EXPECT_NEAR(offsets.last.at(6).first, 0.002, 1e-12);
  EXPECT_NEAR(offsets.last.at(6).second, 0.01, 1e-4);
  EXPECT_NEAR(offsets.last.at(8).first, 0, 1e-12);
  EXPECT_TRUE(offsets.end.corrections[0].enabled) << "the switch ends with the program";
}

std::string config_error(const std::string& text) {
  try {
    assemble(written("bad.toml", text));
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(CorrectionSwitch, CodesMustBeFree) {
  const std::string cradle_text = text_of(config_of("cradle"));
  const auto with = [&](const std::string& code) {
    std::string tables = kTables;
    tables.replace(tables.find("m432"), 4, code);
    return config_error(cradle_text + tables);
  };
  for (const char* code : {"M3", "M428", "M431", "M1000", "G5", "M"})
    EXPECT_NE(with(code).find("cannot be this code; legal: M0 to M999"), std::string::npos) << with(code);
  EXPECT_EQ(with("M433"), "no error");
  EXPECT_NE(test::error_of(config_of("cradle_measured"), "M422 P1\nM2\n").find("1:6"), std::string::npos);
  EXPECT_NE(test::error_of(config_of("cradle"), "M422\nM2\n"), "no error");
}

}  // namespace
}  // namespace trn
