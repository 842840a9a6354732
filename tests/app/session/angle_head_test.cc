#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "core/frames.h"
#include "tests/app/session/machine_run.h"

// Programs on the mill with the 45 degree head, through the whole kernel, judged in its joints: X and Z carry
// the head, Y the table, whose joint runs against its word.
namespace trn::test {
namespace {

const double kS = std::sqrt(0.5);

/// The tip in machine coordinates of a tool of that length: the nose, less the tool along (0, -s, s).
Vec3 tip_of(const JointVec& q, double length_mm) {
  return Vec3(q[0], -q[1], q[2]) - length_mm * Vec3(0, -kS, kS);
}

TEST(AngleHeadRuns, TheTipIsWhereTheProgramSays) {
  const MachineRun run = run_text(config_of("angle_head"),
                                  "G21 G90 G94 G61 F3000\nT1 M6\nG43 H1\nG1 X10 Y5 Z3\nG1 X30 Y-20 Z9\n"
                                  "G49\nG1 X30 Y-20 Z9\nM2\n");
  const auto last_of = [&](std::uint32_t line) {
    JointVec q = JointVec::Zero(3);
    for (const Sample& s : run.samples)
      if (s.line == line) q = s.q;
    return q;
  };
  EXPECT_LT((tip_of(last_of(4), 50) - Vec3(10, 5, 3)).norm(), 1e-9);
  EXPECT_LT((tip_of(last_of(5), 50) - Vec3(30, -20, 9)).norm(), 1e-9);
  EXPECT_LT((tip_of(last_of(7), 0) - Vec3(30, -20, 9)).norm(), 1e-9);
  // On the way the tip stays on the line.
  const Vec3 from(10, 5, 3), way = Vec3(20, -25, 6).normalized();
  for (const Sample& s : run.samples)
    if (s.line == 5) {
      EXPECT_LT((tip_of(s.q, 50) - from).cross(way).norm(), 1e-6);
    }
}

// The shipped program: five holes of 14 mm, square to the chamfer, and the tip on the chamfer when it is
// milled.
TEST(AngleHeadRuns, TheHolesAreSquareToTheChamfer) {
  const MachineRun run = run_file(config_of("angle_head"), source_dir() + "/examples/angled_holes.ngc");
  const Vec3 zero(0, -24, -6), up(0, kS, kS), out(0, -kS, kS);
  EXPECT_LT(run.result.deviation.tip_ratio.value, 1.0);
  double deepest = 0, lowest = 1e9;
  int in_holes = 0;
  for (const Sample& s : run.samples) {
    const bool drills = s.line >= 37 && s.line <= 41;
    const Vec3 p = tip_of(s.q, drills ? 95 : 80) - zero;
    const double height = p.dot(out);
    if (s.line >= 21 && s.line <= 25) lowest = std::min(lowest, height);
    if (!drills || height > -0.1) continue;
    ++in_holes;
    deepest = std::min(deepest, height);
    EXPECT_LT(std::abs(p.dot(up)), 1e-6);
    EXPECT_LT(std::abs(std::remainder(p.x(), 20)), 1e-6);
  }
  EXPECT_GT(in_holes, 1000);
  EXPECT_NEAR(deepest, -14, 1e-6);
  EXPECT_NEAR(lowest, 0, 0.011);  // milled down to the chamfer, within the tolerance
}

}  // namespace
}  // namespace trn::test
