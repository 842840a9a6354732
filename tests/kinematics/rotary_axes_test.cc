#include "kinematics/serial/rotary_axes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

#include "core/frames.h"
#include "core/units.h"

// The angles that point the tool along a direction.
namespace trn {
namespace {

TEST(RotaryAxes, AnAxisAlongTheToolStaysWhereItIs) {
  RotaryAxes axes;
  ASSERT_TRUE(axes.add_axis(Vec3::UnitZ()));
  const auto found = axes.solve(Vec3::UnitZ(), {0.7, -0.4});
  ASSERT_EQ(found.count, 1);
  EXPECT_EQ(found.angles[0][0], 0.7);
  EXPECT_EQ(axes.solve(Vec3::UnitX(), {0.7, -0.4}).count, 0) << "it cannot tilt the tool";
}

TEST(RotaryAxes, OneAxisTurnsOnFromItsSeed) {
  RotaryAxes axes;
  ASSERT_TRUE(axes.add_axis(Vec3::UnitX()));
  const double angle = 0.3, turns = 20 * kPi;
  const auto found = axes.solve(rot_x(angle) * Vec3::UnitZ(), {turns, -1.0});
  ASSERT_EQ(found.count, 1);
  EXPECT_NEAR(found.angles[0][0], turns + angle, 1e-12);
}

// Two axes the same way turn the tool in one plane only, and a second one along the tool does not turn it at
// all.
TEST(RotaryAxes, TwoAxesWithoutAClosedFormAreTold) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  const std::vector<std::tuple<Vec3, Vec3, bool>> cases = {{x, x, false},  {x, -x, false}, {x, z, false},
                                                           {x, -z, false}, {z, z, false},  {x, y, true},
                                                           {z, x, true}};
  for (const auto& [first, second, closed] : cases) {
    RotaryAxes axes;
    EXPECT_TRUE(axes.add_axis(first));
    EXPECT_EQ(axes.add_axis(second), closed) << first.transpose() << " and " << second.transpose();
  }
}

TEST(RotaryAxes, AtThePoleOfTwoTheFirstStaysWhereItIs) {
  RotaryAxes axes;
  ASSERT_TRUE(axes.add_axis(Vec3::UnitZ()));
  ASSERT_TRUE(axes.add_axis(Vec3::UnitX()));
  const auto found = axes.solve(Vec3::UnitZ(), {2.5, 0.1});
  ASSERT_EQ(found.count, 2);
  for (const auto& angles : found.angles) {
    EXPECT_EQ(angles[0], 2.5);
    EXPECT_NEAR(angles[1], 0, 1e-12);
  }
}

}  // namespace
}  // namespace trn
