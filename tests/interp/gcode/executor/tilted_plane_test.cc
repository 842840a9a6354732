#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "tests/interp/gcode/run_program.h"
#include "tests/kinematics/machines.h"

// G68.3: the plane that stands square to the tool as it is.
namespace trn {
namespace {

struct Case {
  const char* machine;
  // Spindle in the table's frame, and the frame of the program in it, as the config's own axes give them.
  Mat3 (*R_BS)(double a, double c);
  Vec3 p_BM;
};
const Case kCases[] = {
    {"cradle", [](double a, double c) { return Mat3((rot_x(a) * rot_z(c)).transpose()); }, {0, 0, 75}},
    {"head", [](double a, double c) { return Mat3(rot_z(c) * rot_x(a)); }, {0, 0, 0}},
};

test::Session session_on(const std::string& machine) {
  test::Session session;
  session.kinematics = std::shared_ptr<Kinematics>(load_machine(machine).kinematics);
  return session;
}

TEST(PlaneSquareToTheTool, HasTheSpindlesAxes) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-60, 60);
  for (const Case& on : kCases)
    for (int i = 0; i < 20; ++i) {
      const double a = any(random), c = any(random), turn = any(random), r = any(random);
      const Vec3 o(any(random), any(random), any(random)), to(any(random), any(random), any(random));
      test::Session session = session_on(on.machine);
      const auto moves =
          session.moves(fmt::format("G21 G10 L2 P1 X5 Y-7 Z3 R{}\nG43.4 H1\nG0 X10 Y20 Z90\nG0 A{} "
                                    "C{}\nG68.3 X{} Y{} Z{} R{}\nG0 X{} Y{} "
                                    "Z{}\nM2\n",
                                    turn, a, c, o.x(), o.y(), o.z(), r, to.x(), to.y(), to.z()));
      const Vec3 origin_B = on.p_BM + Vec3(5, -7, 3) + rot_z(turn * kRadPerDeg) * o;
      const Vec3 expected = origin_B + on.R_BS(a * kRadPerDeg, c * kRadPerDeg) * (rot_z(r * kRadPerDeg) * to);
      EXPECT_LT((moves.moves.back().to.head<3>() - expected).norm(), 1e-9) << on.machine;
      EXPECT_TRUE(moves.moves.back().context.rtcp);
    }
}

// Neither RTCP nor the plane moves the machine, so what G53 calls the place stays.
TEST(PlaneSquareToTheTool, LeavesTheMachineWhereItStands) {
  for (const Case& on : kCases) {
    test::Session session = session_on(on.machine);
    std::string program = "G21 G10 L2 P1 X5 Y-7 Z3 R20\nG43 H1\nG0 X10 Y20 Z30 A35 C-50\n";
    int n = 100;
    for (const char* step : {"", "G43.4 H1", "G68.3 X1 Y2 Z3", "G69", "G49"})
      program += fmt::format("{}\n#{}=#<_abs_x> #{}=#<_abs_y> #{}=#<_abs_z>\n", step, n, n + 1, n + 2),
          n += 3;
    session.moves(program + "M2\n");
    const Parameters& p = session.parameters;
    for (int k = 103; k < n; ++k) EXPECT_NEAR(p[k], p[100 + (k - 100) % 3], 1e-9) << on.machine << " " << k;
  }
}

TEST(PlaneSquareToTheTool, IsRefusedInsideAnotherAndWithoutAMachine) {
  test::Session session = session_on("cradle");
  EXPECT_THROW(session.moves("G68.3 X0 Y0 Z0\nG68.3 X1\nM2\n"), GcodeError);
  EXPECT_THROW(session.moves("G68.3 A5\nM2\n"), GcodeError);
  test::Session plain;
  EXPECT_THROW(plain.moves("G68.3 X0 Y0 Z0\nM2\n"), GcodeError);
}

}  // namespace
}  // namespace trn
