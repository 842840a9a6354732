#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "app/lab/ball_contacts.h"
#include "app/lab/ball_plan.h"
#include "app/session/assembly.h"
#include "app/session/program_log.h"
#include "app/session/simulation.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ball_fit.h"
#include "compensation/geometric.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/support/paths.h"

// The calibration by a ball, from the program to the corrected machine, and the plan of its positions.
namespace trn {
namespace {

namespace fs = std::filesystem;

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The simulated machine that the example is for: its section [io] says where its axes really lie.
std::string machine_text(unsigned seed) {
  std::string text = text_of(source_dir() + "/configs/cradle_ball.toml");
  const std::string noise = "noise_mm = 0.001";
  text.replace(text.find(noise), noise.size(), noise + "\nseed = " + std::to_string(seed));
  return text;
}

Assembly machine_of(const std::string& text) { return assemble(parse_config(text, "cradle_ball.toml")); }

/// Runs examples/probing/ball_calibration.ngc; the file of its contacts.
std::string measure(const std::string& machine, const fs::path& folder) {
  Assembly assembly = machine_of(machine);
  Parameters parameters;
  ToolTable tools = ToolTable::load(source_dir() + "/examples/tools.tbl");
  ProgramLog log(folder.string(), {});
  SimulationOptions options;
  options.program = source_dir() + "/examples/probing/ball_calibration.ngc";
  options.on_log = [&](const canon::Log& written, std::uint32_t line) { log.take(written, line); };
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  EXPECT_EQ(result.fault, Fault::kOk);
  EXPECT_TRUE(result.within_limits);
  return (folder / "ball_contacts.csv").string();
}

/// Where the axes of the simulated machine really lie.
ActualChain truth_of(const std::string& machine) {
  const Assembly assembly = machine_of(machine);
  ActualChain chain = read_chain(assembly.machine);
  read_axis_errors(assembly.machine, assembly.machine.root.table("io").table("errors"), chain);
  return chain;
}

double value_in(ActualChain chain, const BallParameter& p) {
  const SixErrors& e = find_axis(chain, p.joint)->location;
  return (p.kind == BallParameter::Kind::kTilt ? e.tilt : e.offset)[p.component];
}

class BallCalibration : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

// The program touches the ball on a machine whose errors nobody has told it, the fit finds them, and the
// corrected machine, touched again with other noise, has none that could be told from the noise.
TEST_F(BallCalibration, FindsTheErrorsAndCuresThem) {
  const std::string machine = machine_text(1);
  const ActualChain truth = truth_of(machine);
  const Assembly before = machine_of(machine);
  const ActualChain known = known_chain(before.machine);
  const auto contacts = read_ball_contacts(measure(machine, folder_), before, 0, {});
  ASSERT_EQ(contacts.size(), 65u);
  const BallFit fit = fit_ball(known, contacts);
  EXPECT_GT(fit.before_mm, 0.02);
  // 1 um of the switch, and a quarter of one that a period is long.
  EXPECT_NEAR(fit.noise_mm, 0.001, 0.0003);
  int errors = 0;
  for (const BallParameter& p : fit.parameters) {
    if (p.joint < 0) continue;
    ++errors;
    EXPECT_EQ(p.unknown, "") << p.name;
    EXPECT_LT(std::abs(p.value - value_in(truth, p)), 4 * p.deviation) << p.name;
  }
  EXPECT_EQ(errors, 8);

  const std::string corrected = machine_text(2) + "\n" + ball_config_section(fit, before.machine);
  const Assembly after = machine_of(corrected);
  const auto again = read_ball_contacts(measure(corrected, folder_), after, 0, {});
  const BallFit second = fit_ball(known_chain(after.machine), again);
  EXPECT_LT(second.before_mm, 1.3 * 0.001) << "from one sphere, as the machine is known now";
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const BallParameter& p = second.parameters[i];
    if (p.joint < 0) continue;
    EXPECT_LT(std::abs(p.value - fit.parameters[i].value), 4 * std::sqrt(2.0) * p.deviation) << p.name;
  }
}

// Without the config's correction in force the same axes' places are other joints.
TEST_F(BallCalibration, ContactsAreReadWithTheCorrectionsThatWereInForce) {
  std::ofstream(folder_ / "c.csv") << "x_mm,y_mm,z_mm,a_deg,c_deg\n10,20,30,40,50\n";
  const Assembly assembly = machine_of(text_of(source_dir() + "/configs/cradle_measured.toml"));
  const std::string file = (folder_ / "c.csv").string();
  const BallProbe probe{100, 6};
  const JointVec on = read_ball_contacts(file, assembly, 0, probe)[0].q;
  const JointVec off = read_ball_contacts(file, assembly, kGeometricBit, probe)[0].q;
  const JointVec plain = (JointVec(5) << 10, 20, 30, 40 * kRadPerDeg, 50 * kRadPerDeg).finished();
  EXPECT_LT((off - plain).norm(), 1e-12);
  EXPECT_GT((on - plain).head<3>().norm(), 0.02);
  EXPECT_EQ(read_ball_contacts(file, assembly, 0, probe)[0].stylus_S, Vec3(0, 0, -97));
}

TEST_F(BallCalibration, FilesThatAreWrongSayWhere) {
  const Assembly assembly = machine_of(machine_text(1));
  const auto refusal = [&](const std::string& text, const BallProbe& probe) -> std::string {
    std::ofstream(folder_ / "c.csv") << text;
    try {
      read_ball_contacts((folder_ / "c.csv").string(), assembly, 0, probe);
      return "";
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr((folder_ / "c.csv").string().size());
    }
  };
  const BallProbe probe{100, 6};
  const std::string head = "x_mm,y_mm,z_mm,a_deg,c_deg\n";
  EXPECT_EQ(refusal(head + "1,2,3,4,5\n", probe), "");
  EXPECT_EQ(refusal(head + "\n# remark\n1;2;3;4;5\r\n", probe), "");
  EXPECT_EQ(refusal("x_mm,y_mm\n", probe), ":1: a column z_mm is missing");
  EXPECT_EQ(refusal("x_mm,y_mm,z_mm,w\n", probe).substr(0, 23), ":1: unknown column 'w';");
  EXPECT_EQ(refusal(head + "1,2,3,4\n", probe), ":2: 4 columns, but the headline has 5");
  EXPECT_EQ(refusal(head + "1,2,x,4,5\n", probe), ":2: 'x' is no number");
  EXPECT_EQ(refusal(head + "1,2,3,4,5\n", {}), ":2: no column length_mm; give --length-mm");
}

// The plan is greedy: no other position of the grid would have left less. And its eight positions are worth
// more than eight that go round in even steps.
TEST(BallPlan, TakesTheBestPositionEachTime) {
  const Assembly assembly = machine_of(machine_text(1));
  const ActualChain known = known_chain(assembly.machine);
  BallTouches touches;
  touches.ball_M = Vec3(0.4, 100.3, -25.2);
  touches.step_rad = 30 * kRadPerDeg;
  const std::vector<BallPosition> all = ball_positions(assembly, touches);
  ASSERT_GT(all.size(), 50u);
  for (const BallPosition& position : all) {
    EXPECT_LE(std::abs(position.abc_rad[0]), kPi / 2 + 1e-9) << "not from below";
    EXPECT_EQ(position.contacts.size(), 5u);
    for (const BallContact& contact : position.contacts)
      EXPECT_NEAR(ball_gap(known, contact, touches.ball_M + Vec3(0, 0, 75), 15.5), 0, 1e-9);
  }
  const BallInformation nothing(known, touches.ball_M + Vec3(0, 0, 75), 15.5, 0.001);
  BallInformation information = nothing;
  const std::vector<BallPosition> plan = plan_ball(all, 8, information);
  BallInformation so_far = nothing;
  for (const BallPosition& chosen : plan) {
    double least = std::numeric_limits<double>::infinity();
    for (const BallPosition& other : all) least = std::min(least, so_far.axes_mm(other.contacts));
    EXPECT_NEAR(chosen.axes_mm, least, 1e-9 * least);
    so_far.add(chosen.contacts);
    EXPECT_NEAR(so_far.axes_mm(), chosen.axes_mm, 1e-9);
  }
  EXPECT_NEAR(information.axes_mm(), plan.back().axes_mm, 1e-12);
  BallInformation even = nothing;
  int taken = 0;
  for (const BallPosition& position : all)
    for (const auto& [a, c] :
         {std::pair{-60, 0}, {-60, 90}, {-60, 180}, {-60, -90}, {60, 0}, {60, 90}, {60, 180}, {60, -90}})
      if ((position.abc_rad - Vec3(a, 0, c) * kRadPerDeg).norm() < 1e-6) {
        even.add(position.contacts);
        ++taken;
      }
  ASSERT_EQ(taken, 8);
  EXPECT_LT(information.axes_mm(), even.axes_mm());
}

}  // namespace
}  // namespace trn
