#include "app/lab/plan_preview.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/simulation.h"
#include "core/differencer.h"
#include "core/fault.h"
#include "core/ports.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

/// What the machine really does, period by period.
struct Driven final : ReportSink {
  struct Tick {
    Vec3 p_B;
    std::vector<double> share;  ///< of each joint, the greatest of its three limits
    std::uint32_t line;
  };
  explicit Driven(const Assembly& assembly) : assembly_(assembly), q_(assembly.machine.joints.size()) {}
  void write(const CycleReport& report) override {
    Tick tick{Vec3::Zero(), std::vector<double>(q_.size()), report.line};
    for (std::size_t i = 0; i < q_.size(); ++i) {
      const JointLimit& limit = assembly_.plan_joints[i].limit;
      const Derivatives d =
          q_[i].next(report.q_plan[static_cast<Eigen::Index>(i)], assembly_.machine.period_s);
      tick.share[i] =
          std::max({std::abs(d.velocity) / limit.velocity, std::abs(d.acceleration) / limit.acceleration,
                    std::abs(d.jerk) / limit.jerk});
    }
    ToolPose tool;
    if (!report.on_path ||
        tool_pose(*assembly_.kinematics, report.q_plan, report.context, tool) != KinStatus::kOk)
      return;
    tick.p_B = tool.p_B;
    ticks.push_back(tick);
  }
  std::vector<Tick> ticks;

 private:
  const Assembly& assembly_;
  std::vector<Differencer> q_;
};

class Preview : public ::testing::Test {
 protected:
  PlanPreview plan(const std::string& program, PreviewOptions options = {}) {
    Parameters parameters;
    ToolTable tools = tools_;
    return preview_plan(assembly_, parameters, tools, {"part", program, standing_joints(assembly_)}, options);
  }
  Driven driven(const std::string& program) {
    Driven out(assembly_);
    Parameters parameters;
    ToolTable tools = tools_;
    SimulationOptions options;
    options.program = "part";
    options.program_text = program;
    options.trace = &out;
    EXPECT_EQ(simulate(assembly_, parameters, tools, options).fault, Fault::kOk);
    return out;
  }
  static double distance_to_way(const Vec3& p, const std::vector<PlanPoint>& points) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < points.size(); ++i) {
      if (points[i].jump) continue;
      const Vec3 from = points[i - 1].p_B, way = points[i].p_B - from;
      const double length = way.squaredNorm();
      const double share = length > 0 ? std::clamp((p - from).dot(way) / length, 0.0, 1.0) : 0;
      least = std::min(least, (p - from - share * way).norm());
    }
    return least;
  }

  Assembly assembly_ = assemble(source_dir() + "/configs/cradle.toml");
  ToolTable tools_ = ToolTable::load(source_dir() + "/examples/tools.tbl");
};

constexpr const char* kFiveAxis =
    "G21 G90 G94\nT1 M6\nG43.4 H1\nG64 P0.01\nG0 X30 Y0 Z20\nG1 Z0 F3000\nG1 X-30 A20 C40 F6000\nG2 X30 Y0 "
    "I30 J0\n"
    "G1 Y20 A-10 C0\nG49\nG0 X10 Y10\nM2\n";

TEST_F(Preview, DrawsTheWayThatTheMachineGoes) {
  const PlanPreview preview = plan(kFiveAxis);
  ASSERT_TRUE(preview.message.empty()) << preview.message;
  const Driven truth = driven(kFiveAxis);
  ASSERT_GT(truth.ticks.size(), 1000u);
  for (std::size_t i = 0; i < truth.ticks.size(); i += 7)
    ASSERT_LT(distance_to_way(truth.ticks[i].p_B, preview.points), 0.03) << "at line " << truth.ticks[i].line;
  EXPECT_NEAR(preview.time_s, static_cast<double>(truth.ticks.size()) * assembly_.machine.period_s, 0.05);
}

TEST_F(Preview, NamesTheJointThatLimits) {
  // X has the least acceleration for its way here; then Z does, alone.
  const PlanPreview preview = plan("G21 G90 G94\nG61.1\nG1 X200 F60000\nG1 Z200 F60000\nM2\n");
  const Driven truth = driven("G21 G90 G94\nG61.1\nG1 X200 F60000\nG1 Z200 F60000\nM2\n");
  for (const std::uint32_t line : {3u, 4u}) {
    std::vector<double> most(assembly_.machine.joints.size());
    for (const Driven::Tick& tick : truth.ticks)
      for (std::size_t i = 0; tick.line == line && i < most.size(); ++i)
        most[i] = std::max(most[i], tick.share[i]);
    const auto joint = static_cast<int>(std::max_element(most.begin(), most.end()) - most.begin());
    EXPECT_EQ(joint, line == 3 ? 0 : 2);
    int named = 0;
    float use = 0;
    for (const PlanPoint& point : preview.points) {
      if (point.line != line || point.joint < 0) continue;
      EXPECT_EQ(point.joint, joint) << "at line " << line;
      use = std::max({use, point.velocity, point.acceleration, point.jerk});
      ++named;
    }
    EXPECT_GT(named, 2);
    EXPECT_NEAR(use, most[static_cast<std::size_t>(joint)], 0.03);
  }
}

TEST_F(Preview, TellsHowLongNoJointLimits) {
  std::ostringstream program;
  program << "G21 G90 G94\nG64 P0.05\nF20000\n";
  for (int i = 0; i < 400; ++i) program << "G1 X" << 0.5 * i << " Z" << 6 * std::sin(0.2 * i) << "\n";
  program << "F300\nG1 X100 Z0\nG1 X90\nM2\n";
  const PlanPreview preview = plan(program.str());
  const Driven truth = driven(program.str());
  double free = 0;
  for (const Driven::Tick& tick : truth.ticks)
    free += *std::max_element(tick.share.begin(), tick.share.end()) < 0.95;
  const double share = free / static_cast<double>(truth.ticks.size());
  EXPECT_GT(share, 0.1);
  EXPECT_LT(share, 0.99);
  EXPECT_NEAR(preview.free_s / preview.time_s, share, 0.05);
}

TEST_F(Preview, TellsFeedAskedAndReached) {
  const PlanPreview preview = plan("G21 G90 G94\nG61.1\nG0 X10\nG1 X110 F600\nG1 X111 F60000\nM2\n");
  double reached = 0, short_reached = 0;
  for (const PlanPoint& point : preview.points) {
    EXPECT_EQ(point.rapid, point.line == 3);
    EXPECT_NEAR(point.feed_mm_s, point.line == 3 ? 0 : point.line == 4 ? 10 : 1000, 1e-9);
    if (point.line == 4) reached = std::max(reached, point.speed_mm_s);
    if (point.line == 5) short_reached = std::max(short_reached, point.speed_mm_s);
  }
  EXPECT_NEAR(reached, 10, 0.01);
  EXPECT_LT(short_reached, 500) << "no machine reaches 1000 mm/s within a millimetre";
  EXPECT_NEAR(preview.cut_mm, 101, 0.01);
  EXPECT_NEAR(preview.rapid_mm, 10, 0.01);
}

TEST_F(Preview, OfABadProgramGoesUpToItsError) {
  const PlanPreview preview = plan("G21 G90 G94\nG1 X10 F600\nG1 X20\nG1 X9999\nM2\n");
  EXPECT_NE(preview.message.find("part:4"), std::string::npos) << preview.message;
  ASSERT_FALSE(preview.points.empty());
  // Where the machine would stand: the move before the error ends early, as what follows is not known.
  EXPECT_GT(preview.points.back().p_B[0], 10);
  EXPECT_LE(preview.points.back().p_B[0], 20);
}

TEST_F(Preview, OfAnEndlessProgramEnds) {
  PreviewOptions options;
  options.time_max_s = 20;
  const PlanPreview preview =
      plan("G21 G90 G94\nO1 WHILE [1]\nG1 X10 F6000\nG1 X0\nO1 ENDWHILE\nM2\n", options);
  EXPECT_FALSE(preview.message.empty());
  EXPECT_NEAR(preview.time_s, 20, 1);
}

TEST_F(Preview, KeepsToTheNumberOfPoints) {
  std::ostringstream program;
  program << "G21 G90 G94\nG64 P0.001\nF6000\n";
  for (int i = 0; i < 1000; ++i)
    program << "G1 X" << 40 * std::cos(0.1 * i) << " Y" << 40 * std::sin(0.13 * i) << "\n";
  program << "M2\n";
  PreviewOptions options;
  options.points_max = 800;
  const PlanPreview whole = plan(program.str()), coarse = plan(program.str(), options);
  EXPECT_GT(whole.points.size(), 800u);
  EXPECT_LE(coarse.points.size(), 800u);
  EXPECT_EQ(coarse.time_s, whole.time_s);
  EXPECT_EQ(coarse.box_B[0], whole.box_B[0]);
}

// The tip stays in the tolerance, and how far it is from the two lines is plain geometry.
TEST_F(Preview, TellsHowFarTheTipLeavesTheProgram) {
  const std::string begin = "G21 G90 G94\nT1 M6\nG43.4 H1\n",
                    corner = "\nG0 X0 Y0 Z0\nG1 X40 F3000\nG1 Y40\nG49\nM2\n";
  constexpr double kTable = 75;  // where the table frame has the program's Z 0 on this machine
  const auto to_lines = [](const Vec3& p) {
    const double z = p[2] - kTable, first = Vec3(p[0] - std::clamp(p[0], 0.0, 40.0), p[1], z).norm();
    return std::min(first, Vec3(p[0] - 40, p[1] - std::clamp(p[1], 0.0, 40.0), z).norm());
  };
  for (const bool blended : {true, false}) {
    const PlanPreview preview = plan(begin + (blended ? "G64 P0.05" : "G61") + corner);
    ASSERT_TRUE(preview.message.empty()) << preview.message;
    double most = 0, told = 0;
    for (const PlanPoint& point : preview.points) {
      if (point.line < 6 || point.line > 7 || point.rapid) continue;
      const double off = to_lines(point.p_B);
      EXPECT_LT(off, point.deviation_mm + 1e-5) << point.p_B.transpose();
      most = std::max(most, off);
      told = std::max(told, static_cast<double>(point.deviation_mm));
    }
    EXPECT_NEAR(told, most, 0.003);  // a point that was left out may have been farther
    EXPECT_LT(told, blended ? 0.0501 : 1e-5);
    EXPECT_TRUE(!blended || told > 0.02) << told;
  }
}

TEST(PlanPoints, ThoseOfAStraightWayMayBeLeftOut) {
  std::vector<PlanPoint> points(9);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i].p_B = Vec3(static_cast<double>(i), i == 4 ? 1 : 0, 0);
  rate_points(points, 0, 1024);
  EXPECT_TRUE(std::isinf(points.front().significance) && std::isinf(points.back().significance));
  EXPECT_NEAR(points[4].significance, 1, 1e-6);
  for (const std::size_t i : {1u, 2u, 6u, 7u}) EXPECT_LT(points[i].significance, 1);
}

TEST_F(Preview, IsWrittenAsThePageReadsIt) {
  const PlanPreview preview = plan("G21 G90 G94\nG1 X10 F600\nM2\n");
  const std::string path = ::testing::TempDir() + "plan_preview_test";
  write_plan(path, preview, assembly_.machine, "part");
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  ASSERT_EQ(bytes.substr(0, 8), "TRNPLAN2");
  std::size_t size = 0;
  for (std::size_t i = 0; i < 4; ++i)
    size |= static_cast<std::size_t>(static_cast<unsigned char>(bytes[8 + i])) << (8 * i);
  const nlohmann::json head = nlohmann::json::parse(bytes.substr(12, size));
  const std::size_t n = head["count"];
  ASSERT_EQ(n, preview.points.size());
  EXPECT_EQ(head["joints"][0]["name"], "X");
  const auto whole = [](std::size_t at) { return (at + 3) / 4 * 4; };
  EXPECT_EQ(bytes.size(), whole(12 + size) + 9 * 4 * n + 5 * whole(n));
  float x = 0;
  std::copy_n(bytes.data() + whole(12 + size) + 4 * (n - 1), 4, reinterpret_cast<char*>(&x));
  EXPECT_NEAR(x, 10, 1e-4);
}

}  // namespace
}  // namespace trn
