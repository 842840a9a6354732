#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/simulation.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// Programs through the whole kernel on simulated drives, and where the tool then was, judged by formulas that
// share no code with kinematics/.
namespace trn::test {

/// One period at work on the path.
struct Sample {
  std::uint32_t line = 0;
  JointVec q;
  Vec3 p_B, u_B;  ///< tip and axis in the table frame
  Vec3 p_W, u_W;  ///< in the program's frame
};

struct MachineRun {
  SimulationResult result;
  std::vector<Sample> samples;
  Sample start;  ///< before anything moved, in the first sample's frames
};

/// A shipped machine's config, or one that exists only in the tests.
inline std::string config_of(const std::string& machine) {
  const std::string shipped = source_dir() + "/configs/" + machine + ".toml";
  return std::filesystem::exists(shipped) ? shipped
                                          : source_dir() + "/tests/data/machines/" + machine + ".toml";
}

inline std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline std::string written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + "/" + name;
  std::ofstream(path) << text;
  return path;
}

class Recorder : public ReportSink {
 public:
  Recorder(const Kinematics& kinematics, MachineRun& run) : kinematics_(kinematics), run_(run) {}
  void write(const CycleReport& report) override {
    if (!report.on_path) {
      // The program begins where the drives stood at last: an encoder's readings need not agree to the digit.
      if (run_.samples.empty()) run_.start.q = report.q_setpoint;
      return;
    }
    if (run_.samples.empty()) run_.start = sample(run_.start.q, report);
    run_.samples.push_back(sample(report.q_setpoint, report));
  }

 private:
  Sample sample(const JointVec& q, const CycleReport& report) const {
    ToolPose pose;
    EXPECT_EQ(tool_pose(kinematics_, q, report.context, pose), KinStatus::kOk);
    return {report.line, q, pose.p_B, pose.u_B, pose.p_W, pose.u_W};
  }

  const Kinematics& kinematics_;
  MachineRun& run_;
};

/// Runs a program file; tools 1, 2, 3 are 50, 80 and 95 mm long. ProgramError as the kernel throws it.
inline MachineRun run_file(const std::string& config, const std::string& program) {
  Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50 D6\nT2 P2 Z+80 D8\nT3 P3 Z+95 D5\n", "t.tbl");
  MachineRun run;
  run.start.q = standing_joints(assembly);
  check_program(assembly, parameters, tools, {program, std::nullopt, run.start.q}, {});
  Recorder recorder(*assembly.kinematics, run);
  SimulationOptions options;
  options.program = program;
  options.trace = &recorder;
  run.result = simulate(assembly, parameters, tools, options);
  EXPECT_EQ(run.result.fault, Fault::kOk);
  EXPECT_TRUE(run.result.within_limits);
  return run;
}

inline MachineRun run_text(const std::string& config, const std::string& text) {
  return run_file(config, written("program.ngc", text));
}

inline std::string error_of(const std::string& config, const std::string& text) {
  try {
    run_text(config, text);
  } catch (const ProgramError& error) {
    return error.what();
  }
  return "no error";
}

/// Tip and axis in the table frame of a serial machine, from its joints by the formulas of
/// docs/sources.md S1.3 (cradle, no errors) and S2.2 (head).
inline std::pair<Vec3, Vec3> paper_tip(const std::string& machine, const JointVec& q, double L) {
  const double a = q[3], c = q[4];
  const Vec3 P(q[0], q[1], q[2]);
  if (machine == "head") {
    const Vec3 u(std::sin(c) * std::sin(a), -std::cos(c) * std::sin(a), std::cos(a));
    return {P - L * u, u};
  }
  const Vec3 v = P - Vec3(0, 0, L);
  const Vec3 turned(v.x(), std::cos(a) * v.y() + std::sin(a) * v.z(),
                    -std::sin(a) * v.y() + std::cos(a) * v.z() + 75);
  return {Vec3(std::cos(c) * turned.x() + std::sin(c) * turned.y(),
               -std::sin(c) * turned.x() + std::cos(c) * turned.y(), turned.z()),
          Vec3(std::sin(a) * std::sin(c), std::sin(a) * std::cos(c), std::cos(a))};
}

/// How far a hexapod's legs are from those that hold the table under the tool: tip p and axis u on the
/// platform, turn about the tool 0 (section 3; geometry from the worked numbers).
inline double hexapod_leg_error(const JointVec& q, const Vec3& p, const Vec3& u, double L) {
  static const auto geometry =
      nlohmann::json::parse(text_of(source_dir() + "/tests/data/vectors/hexapod.json"));
  const double A = std::atan2(-u.y(), u.z()), B = std::asin(u.x());
  Mat3 R_WT;
  R_WT << std::cos(B), 0, std::sin(B), std::sin(A) * std::sin(B), std::cos(A), -std::sin(A) * std::cos(B),
      -std::cos(A) * std::sin(B), std::sin(A), std::cos(A) * std::cos(B);
  double worst = 0;
  for (int i = 0; i < 6; ++i) {
    const auto joint = [&](const char* key) {
      const auto& row = geometry.at(key).at(static_cast<std::size_t>(i));
      return Vec3(row.at(0), row.at(1), row.at(2));
    };
    const Vec3 leg =
        Vec3(0, 0, 700 - L) + R_WT.transpose() * (joint("platform_joints") - p) - joint("base_joints");
    worst = std::max(worst, std::abs(leg.norm() - q[i]));
  }
  return worst;
}

/// Every sample's tip and axis are those of the machine's own formulas, tool length L.
inline void expect_true_tips(const std::string& machine, const MachineRun& run, double L) {
  double worst_mm = 0, worst_axis = 0;
  for (const Sample& s : run.samples) {
    if (machine == "hexapod") {
      worst_mm = std::max(worst_mm, hexapod_leg_error(s.q, s.p_B, s.u_B, L));
    } else if (machine == "cradle" || machine == "head") {
      const auto [p, u] = paper_tip(machine, s.q, L);
      worst_mm = std::max(worst_mm, (p - s.p_B).norm());
      worst_axis = std::max(worst_axis, (u - s.u_B).norm());
    }
  }
  EXPECT_LT(worst_mm, 1e-9);
  EXPECT_LT(worst_axis, 1e-12);
}

}  // namespace trn::test
