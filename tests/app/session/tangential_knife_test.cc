#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/units.h"
#include "tests/app/session/machine_run.h"

// The tangential knife through the whole kernel, judged in the machine's joints by closed forms of the path:
// an edge that trails r behind the axis stands at the place of the axis less r along its direction.
namespace trn::test {
namespace {

constexpr double kTrail_mm = 2, kTolerance_mm = 0.02, kTolerance_deg = 0.2;

struct Edge {
  Eigen::Vector2d p;
  double z = 0, c_deg = 0;
};
Edge edge_of(const JointVec& q, double trail_mm = kTrail_mm) {
  return {
      {q[0] - trail_mm * std::cos(q[3]), q[1] - trail_mm * std::sin(q[3])}, q[2] - 45, deg_from_rad(q[3])};
}

/// What a line of the program asks for at a place: how far that is from the path, and the path's direction.
struct Asked {
  double off_mm = 0, direction_deg = 0;
};
using Path = std::function<Asked(const Eigen::Vector2d&)>;

Path line(double x0, double y0, double x1, double y1) {
  return [=](const Eigen::Vector2d& p) {
    const Eigen::Vector2d way(x1 - x0, y1 - y0), d = way.normalized(), from(x0, y0);
    const double along = std::clamp(d.dot(p - from), 0.0, way.norm());
    return Asked{(p - from - along * d).norm(), deg_from_rad(std::atan2(d.y(), d.x()))};
  };
}
Path circle(double x, double y, double r, int turn) {
  return [=](const Eigen::Vector2d& p) {
    const Eigen::Vector2d radial = p - Eigen::Vector2d(x, y);
    return Asked{std::abs(radial.norm() - r), deg_from_rad(std::atan2(radial.y(), radial.x())) + turn * 90};
  };
}

TEST(KnifeRuns, TheEdgePointsAlongThePathAndStaysOnIt) {
  const MachineRun run =
      run_text(config_of("tangential_knife"),
               "G21 G90 G94 G64 P0.02 R0.2\nG43.1 X2 Z45\nTANGON\nG0 X0 Y0 Z5\nG1 Z-3 F2000\n"
               "G1 X40 F6000\nG3 X60 Y20 J20\nG1 Y50\nG2 I-15\nG1 X40 Y30\nG0 Z5\nTANGOF\nM2\n");
  const std::pair<std::uint32_t, Path> paths[] = {{6, line(0, 0, 40, 0)},
                                                  {7, circle(40, 20, 20, 1)},
                                                  {8, line(60, 20, 60, 50)},
                                                  {9, circle(45, 50, 15, -1)},
                                                  {10, line(60, 50, 40, 30)}};
  int cutting = 0, exact = 0, turning = 0;
  double c_before = 0;
  for (const Sample& s : run.samples) {
    const Edge edge = edge_of(s.q);
    const bool turns = std::abs(edge.c_deg - std::exchange(c_before, edge.c_deg)) > 0.01;
    for (const auto& [number, path] : paths) {
      if (s.line != number) continue;
      const Asked asked = path(edge.p);
      const double off_deg = std::abs(std::remainder(edge.c_deg - asked.direction_deg, 360));
      EXPECT_LT(asked.off_mm, kTolerance_mm + 1e-6) << s.line;
      if (off_deg > kTolerance_deg && turns) {
        // On the spot: lifted by 8 mm, out of the material.
        EXPECT_GT(edge.z, 5 - kTolerance_mm) << s.line << " " << off_deg;
        ++turning;
      }
      if (edge.z > -3 + kTolerance_mm) continue;
      ++cutting;
      exact += off_deg < 1e-7 && asked.off_mm < 1e-7;
    }
  }
  EXPECT_GT(cutting, 1500);
  EXPECT_GT(exact, cutting * 9 / 10);
  EXPECT_GT(turning, 100);  // into the circle and out of it
  EXPECT_NEAR(edge_of(run.samples.back().q).c_deg, -135, 1e-6);
  EXPECT_LT(run.result.deviation.tip_ratio.value, 1.0);
}

// Many short moves are a smooth curve: the machine does not stop at their corners, and the knife stands off
// them by half of a corner at most.
TEST(KnifeRuns, ShortMovesAreACurve) {
  std::string program =
      "G21 G90 G94 G64 P0.02 R0.2\nG43.1 X2 Z45\nTANGON\nG0 X20 Y0 Z5\nG1 Z-1 F2000\nF3000\n";
  for (int k = 1; k <= 120; ++k)
    program += fmt::format("G1 X{:.6f} Y{:.6f}\n", 20 * std::cos(k * kPi / 60), 20 * std::sin(k * kPi / 60));
  const MachineRun run = run_text(config_of("tangential_knife"), program + "G0 Z5\nTANGOF\nM2\n");
  const Path path = circle(0, 0, 20, 1);
  double slowest = 1e9;
  const Sample* before = nullptr;
  for (const Sample& s : run.samples) {
    if (s.line < 15 || s.line > 115) continue;  // up to speed
    const Edge edge = edge_of(s.q);
    const Asked asked = path(edge.p);
    EXPECT_LT(asked.off_mm, kTolerance_mm + 20 * (1 - std::cos(kPi / 120)));
    EXPECT_LT(std::abs(std::remainder(edge.c_deg - asked.direction_deg, 360)), 1.5 + 2 * kTolerance_deg);
    if (before) slowest = std::min(slowest, (edge.p - edge_of(before->q).p).norm() / 0.001);
    before = &s;
  }
  EXPECT_GT(slowest, 45);  // of 50 mm/s
}

// Turn after turn in one sense; the joint has no end.
TEST(KnifeRuns, TurnsWithoutAnEnd) {
  const MachineRun run = run_text(config_of("tangential_knife"),
                                  "G21 G90 G94 G64 P0.02\nTANGON\nG0 X5 Y0\nG3 I-5 P80 F9000\nTANGOF\nM2\n");
  EXPECT_NEAR(edge_of(run.samples.back().q).c_deg, 90 + 80 * 360, 1e-6);
  for (const Sample& s : run.samples) {
    if (s.line != 4) continue;
    const double tangent = std::atan2(s.q[1], s.q[0]) + kPi / 2;
    EXPECT_LT(std::abs(std::remainder(s.q[3] - tangent, 2 * kPi)), rad_from_deg(kTolerance_deg));
  }
}

TEST(KnifeRuns, TheShippedProgramStaysWithinItsTolerances) {
  const MachineRun run = run_file(config_of("tangential_knife"), written("gasket.ngc", [] {
                                    std::string text = text_of(source_dir() + "/examples/gasket.ngc");
                                    const std::string tool = "T5 M6\nG43 H5";
                                    return text.replace(text.find(tool), tool.size(), "G43.1 X2 Z45\n");
                                  }()));
  EXPECT_LT(run.result.deviation.tip_ratio.value, 1.0);
  // The hole: a circle of 30 mm, at full depth.
  int in_hole = 0;
  for (const Sample& s : run.samples) {
    const Edge edge = edge_of(s.q);
    if (s.line != 19 || edge.z > -2.99) continue;
    ++in_hole;
    EXPECT_NEAR(edge.p.norm(), 15, kTolerance_mm);
    EXPECT_LT(
        std::abs(std::remainder(edge.c_deg - deg_from_rad(std::atan2(edge.p.y(), edge.p.x())) - 90, 360)),
        0.2);
  }
  EXPECT_GT(in_hole, 500);
}

TEST(KnifeRuns, AMachineWithoutTheAxisIsRefused) {
  std::string text = text_of(config_of("mill"));
  try {
    assemble(written("no_axis.toml", text + "\n[tangential]\naxis = \"C\"\n"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find("no joint obeys the word C"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace trn::test
