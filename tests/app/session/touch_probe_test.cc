#include "core/touch_probe.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "app/session/assembly.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "app/session/simulation.h"
#include "core/config.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// G38 with the touch probe on the drives' own inputs: program, tick, PDOs and emulated drives.
namespace trn {
namespace {

constexpr double kTop_mm = -20.12345678;  // on no period and on no count
constexpr double kCount_mm = 1e-4;

std::string written(const std::string& name, const std::string& text) {
  const std::string path =
      testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + name;
  std::ofstream(path) << text;
  return path;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// The cradle on CAN with a block on its table.
std::string machine(const std::string& probe = "drive") {
  std::ifstream in(source_dir() + "/configs/cradle_can.toml");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string emulation = fmt::format(
      "[drives.emulation]\nprobe_length_mm = 25.0\n[[drives.emulation.plate]]\n"
      "min_mm = [-50, -50, -60]\nmax_mm = [50, 50, {}]\n\n[[drives.bus]]",
      kTop_mm);
  std::string out = replaced(text, "[[drives.bus]]", emulation);
  out = replaced(out, "missed_max = 3 ", "probe = \"" + probe + "\"\nmissed_max = 3 ");
  for (std::size_t at = 0; (at = out.find("\"eds/", at)) != std::string::npos; at += 5)
    out.replace(at + 1, 4, source_dir() + "/configs/eds/");
  return out + "\n[io]\ntype = \"simulated\"\n";
}

struct Reports : ReportSink {
  void write(const CycleReport& report) override { all.push_back(report); }
  std::vector<CycleReport> all;
};

struct ProbeRun {
  ProbeRun(const std::string& config, const std::string& program, SessionLog* log = nullptr)
      : assembly(assemble(written("m.toml", config))) {
    SimulationOptions options;
    options.program = written("p.ngc", program);
    options.trace = &reports;
    options.log = log;
    result = simulate(assembly, parameters, tools, options);
  }
  Assembly assembly;
  Parameters parameters;
  ToolTable tools;
  Reports reports;
  SimulationResult result;
};

const std::string kTool = "G21 G90 G61 F300\nG10 L1 P1 Z25\nT1 M6 G43 H1\nG0 Z0\n";

TEST(TouchProbe, TheContactIsWhereTheDrivesWereAtThatMoment) {
  const ProbeRun run(machine(), kTool + "G38.2 Z-40\nM2\n");
  ASSERT_EQ(run.result.fault, Fault::kOk) << run.assembly.drives->explain_fault(-1);
  EXPECT_TRUE(run.result.within_limits);
  EXPECT_EQ(run.parameters[5070], 1);
  // half a count of the encoder, and the digits of its scale
  EXPECT_NEAR(run.parameters[5063], kTop_mm, 0.5 * kCount_mm + 1e-9);
  // What the periods tell: 5 mm/s, 0.01 mm apart; none of them is the contact.
  double nearest = 1;
  for (const CycleReport& report : run.reports.all)
    nearest = std::min(nearest, std::abs(report.q_measured[2] - (run.parameters[5063] + 25)));
  EXPECT_GT(nearest, 2 * kCount_mm) << "the height of the block is bad for this test";
  printf("    contact %.7f, block %.7f mm; nearest feedback %.4f mm away\n", run.parameters[5063], kTop_mm,
         nearest);
}

TEST(TouchProbe, WithFiveAxesTiltedToo) {
  const ProbeRun run(machine(),
                     kTool + "G0 A20 C30\nG0 Z10\nM428\nG1 X3 Y4 Z0 F2000\nF300\nG38.2 Z-60\nM2\n");
  ASSERT_EQ(run.result.fault, Fault::kOk) << run.assembly.drives->explain_fault(-1);
  EXPECT_NEAR(run.parameters[5063], kTop_mm, 2 * kCount_mm);  // of five encoders
  EXPECT_NEAR(run.parameters[5061], 3, 0.05);                 // servo lag in X
}

TEST(TouchProbe, AwayFromTheBlockItIsTheFallingEdge) {
  const ProbeRun run(machine(), kTool + "G38.2 Z-40\n#1=#5063\nG4 P0.2\nG38.4 Z0\nM2\n");
  ASSERT_EQ(run.result.fault, Fault::kOk) << run.assembly.drives->explain_fault(-1);
  EXPECT_NEAR(run.parameters[1], kTop_mm, 0.5 * kCount_mm + 1e-9);
  EXPECT_NEAR(run.parameters[5063], kTop_mm, 0.5 * kCount_mm + 1e-9);
}

TEST(TouchProbe, TwiceInARowIsArmedAnew) {
  const ProbeRun run(machine(), kTool +
                                    "G38.2 Z-40\n#1=#5063\nG0 Z0\nF60\nG38.3 Z-40\n#2=#5063\nG0 Z0 X80\n"
                                    "F600 G38.3 Z-30\n#3=#5070\nM2\n");
  ASSERT_EQ(run.result.fault, Fault::kOk) << run.assembly.drives->explain_fault(-1);
  EXPECT_NEAR(run.parameters[1], kTop_mm, 0.5 * kCount_mm + 1e-9);
  EXPECT_NEAR(run.parameters[2], kTop_mm, 0.5 * kCount_mm + 1e-9);
  EXPECT_EQ(run.parameters[3], 0) << "beside the block there is nothing";
}

TEST(TouchProbe, NothingThereOrThereAlreadyIsAFault) {
  EXPECT_EQ(ProbeRun(machine(), kTool + "G38.2 Z-15\nM2\n").result.fault, Fault::kProbe);
  EXPECT_EQ(ProbeRun(machine(), kTool + "G38.2 Z-40\nG4 P0.2\nG38.2 Z-50\nM2\n").result.fault, Fault::kProbe);
}

TEST(TouchProbe, TheLogGivesTheSameBits) {
  const std::string path = written("s.log", "");
  SessionLog log(path, {written("m.toml", machine()), "", "", true});
  const ProbeRun run(machine(), kTool + "G38.2 Z-40\nG0 Z[#5063+3]\nM2\n", &log);
  ASSERT_EQ(run.result.fault, Fault::kOk);
  const Session session = read_session(path);
  Assembly assembly = assemble(session.head.machine);
  Parameters parameters;
  ToolTable tools;
  Reports again;
  replay(session, assembly, parameters, tools, again);
  ASSERT_GE(again.all.size(), run.reports.all.size());
  for (std::size_t i = 0; i < run.reports.all.size(); ++i)
    ASSERT_EQ(again.all[i].q_setpoint, run.reports.all[i].q_setpoint) << "period " << i;
}

TEST(TouchProbe, ADriveWithoutOneIsRefusedByName) {
  std::string eds;
  {
    std::ifstream in(source_dir() + "/configs/eds/servo.eds");
    eds.assign(std::istreambuf_iterator<char>(in), {});
  }
  const std::string path = written("servo.eds", replaced(eds, "[60BB]", "[2FBB]"));
  try {
    assemble(written("m.toml", replaced(machine(), source_dir() + "/configs/eds/servo.eds", path)));
    FAIL() << "no error";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("0x60BB"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn
