#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/error.h"
#include "interp/gcode/parameters.h"
#include "tests/interp/gcode/run_program.h"

// A mill whose head bends the tool by 45 degrees towards the back: the tool's axis is (0, -s, s), and no word
// turns it.
namespace trn {
namespace {

const double kS = std::sqrt(0.5);
const Vec3 kTool(0, -kS, kS);

test::Session angle_head() { return test::shipped("angle_head"); }

// The axes do not move when the length comes or goes; what the program calls the place does, along the tool.
TEST(AngleHead, ALengthLiesAlongTheTool) {
  test::Session session = angle_head();
  session.moves(
      "G21 G10 L2 P1 X5 Y-7 Z3 R30\nG0 X10 Y20 Z30\n#100=#<_abs_x> #101=#<_abs_y> #102=#<_abs_z>\n"
      "#110=#<_x> #111=#<_y> #112=#<_z>\nG43 H2\n#103=#<_abs_x> #104=#<_abs_y> #105=#<_abs_z>\n"
      "#113=#<_x> #114=#<_y> #115=#<_z>\nG43.2 H1\n#106=#<_abs_x> #107=#<_abs_y> #108=#<_abs_z>\nG49\n"
      "#116=#<_x> #117=#<_y> #118=#<_z>\nM2\n");
  const Parameters& p = session.parameters;
  const auto at = [&](int first) { return Vec3(p[first], p[first + 1], p[first + 2]); };
  EXPECT_LT((at(103) - at(100)).norm(), 1e-9);
  EXPECT_LT((at(106) - at(100)).norm(), 1e-9);
  EXPECT_LT((at(116) - at(110)).norm(), 1e-9);
  // The program's axes are turned by 30 degrees about Z.
  EXPECT_LT((at(113) - at(110) + rot_z(rad_from_deg(-30)) * (80.5 * kTool)).norm(), 1e-9);
}

// G53 and G30 are places of the head's nose, whatever tool is in it.
TEST(AngleHead, MachineCoordinatesAreThoseOfTheNose) {
  test::Session session = angle_head();
  session.moves(
      "G21 G0 X1 Y2 Z3\nG30.1\nG43 H2\nG0 X0 Y0 Z0\nG53 G0 Y-30 Z100\n#103=#<_abs_x> #104=#<_abs_y> "
      "#105=#<_abs_z>\nG30\n#106=#<_abs_x> #107=#<_abs_y> #108=#<_abs_z>\nM2\n");
  const Parameters& p = session.parameters;
  EXPECT_NEAR(p[103], 0, 1e-9);
  EXPECT_NEAR(p[104], -30, 1e-9);
  EXPECT_NEAR(p[105], 100, 1e-9);
  EXPECT_LT((Vec3(p[106], p[107], p[108]) - Vec3(1, 2, 3)).norm(), 1e-9);
}

TEST(AngleHead, G683LaysThePlaneSquareToTheTool) {
  test::Session session = angle_head();
  const auto moves = session.moves("G21 G43 H1\nG0 X0 Y-60 Z60\nG68.3 X0 Y-24 Z-6\nG0 X4 Y5 Z7\nM2\n").moves;
  // Home lies where the nose is, 110 down and 60 along the head, and so does the table but for what is
  // rounded.
  const Vec3 home = Vec3(0, 0, -110) - 60 * kTool - Vec3(0, 42.426, -152.426);
  const Vec3 wanted = Vec3(0, -24, -6) + Vec3(4, 0, 0) + 5 * Vec3(0, kS, kS) + 7 * kTool;
  EXPECT_LT((moves.back().to.head<3>() - home - wanted).norm(), 1e-9);
  EXPECT_TRUE(moves.back().context.rtcp);
}

// What the axes cannot do, and a length that one coordinate does not tell.
TEST(AngleHead, RefusesByName) {
  test::Session session = angle_head();
  EXPECT_NE(session.error("G68.2 X0 Y0 Z0 I0 J30 K0\nG53.1").find("G53.1: the machine cannot take this pose"),
            std::string::npos);
  EXPECT_EQ(session.error("G68.2 X0 Y0 Z0 I0 J45 K0\nG53.1\nG0 Z10\nG69"), "");  // that is how it stands
  const std::string measured = session.error("T1 M6\nG10 L10 P1 Z0");
  EXPECT_NE(measured.find("p.ngc:2:5: G10 L10"), std::string::npos) << measured;
  EXPECT_NE(measured.find("G10 L1"), std::string::npos);
  EXPECT_NE(session.error("G43.4 H1").find("no tool-centre-point control"), std::string::npos);
}

}  // namespace
}  // namespace trn
