#include "sim/touch_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/units.h"
#include "sim/touch_shapes.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

TouchTable::Config table_of(const std::string& text, const LoadedMachine& loaded) {
  return read_touch_table(loaded.machine, parse_config(text, "io.toml"));
}

constexpr char kTwo[] = R"(
[[plate]]
min_mm = [10, 20, -30]
max_mm = [40, 50, -5]
[[plate]]
min_mm = [100, 100, -30]
max_mm = [101, 101, -29]
)";

// A mill of three axes and no tool: its joints are the tip's place in M.
TEST(TouchTable, AreTouchedInsideAndOnTheirFaces) {
  const LoadedMachine mill = load_machine("mill");
  const TouchTable plates(table_of(kTwo, mill), *mill.kinematics);
  const auto touches = [&](double x, double y, double z) {
    Words words = Words::Zero();
    words.head<3>() = Vec3(x, y, z);
    JointVec q;
    EXPECT_EQ(mill.kinematics->joints_from_words(words, q), KinStatus::kOk);
    return plates.touches(q, Vec3::Zero());
  };
  EXPECT_TRUE(touches(20, 30, -10));
  EXPECT_TRUE(touches(100.5, 100.5, -29.5)) << "the second one";
  const Vec3 low(10, 20, -30), high(40, 50, -5), middle = (low + high) / 2;
  for (int i = 0; i < 3; ++i)
    for (const double out : {-1e-6, 1e-6}) {
      Vec3 below = middle, above = middle;
      below[i] = low[i] + out;
      above[i] = high[i] + out;
      EXPECT_EQ(touches(below.x(), below.y(), below.z()), out > 0) << i;
      EXPECT_EQ(touches(above.x(), above.y(), above.z()), out < 0) << i;
    }
}

// The probe's tip lies below the spindle's nose by the tool's length.
TEST(TouchTable, AreTouchedByTheTipAndNotByTheNose) {
  const LoadedMachine mill = load_machine("mill");
  const TouchTable plates(table_of(kTwo, mill), *mill.kinematics);
  Words words = Words::Zero();
  words.head<3>() = Vec3(20, 30, -10);
  JointVec q;
  ASSERT_EQ(mill.kinematics->joints_from_words(words, q), KinStatus::kOk);
  EXPECT_TRUE(plates.touches(q, {0, 0, 19.9}));
  EXPECT_FALSE(plates.touches(q, {0, 0, 20.1}));
  EXPECT_FALSE(plates.touches(q, {0, 0, -5.1}));
}

TEST(TouchTable, NoneAreNeverTouched) {
  const LoadedMachine mill = load_machine("mill");
  const TouchTable plates(table_of("", mill), *mill.kinematics);
  EXPECT_TRUE(plates.empty());
  EXPECT_FALSE(plates.touches(JointVec::Zero(mill.kinematics->joint_count()), Vec3::Zero()));
}

TEST(TouchTable, AFlatOneIsRefused) {
  for (const char* max : {"[10, 50, -5]", "[40, 20, -5]", "[40, 50, -31]"}) {
    const std::string text = std::string("[[plate]]\nmin_mm = [10, 20, -30]\nmax_mm = ") + max + "\n";
    EXPECT_THROW(read_touch_shapes(parse_config(text, "io.toml")), ConfigError) << max;
  }
}

double distance_in(const std::string& text, const Vec3& p) {
  return distance(read_touch_shapes(parse_config(text, "io.toml")), p);
}

// Distances that plane geometry gives: faces, edges and corners of a block that is turned and moved.
TEST(TouchShapes, ATurnedPlateIsMeasuredInItsOwnFrame) {
  const std::string plate =
      "[[plate]]\nat_mm = [100, -50, 7]\nturn_deg = [30, 40, -20]\nmin_mm = [-10, -20, -30]\nmax_mm = [10, "
      "20, "
      "0]\n";
  const Pose X{rot_z(30 * kRadPerDeg) * rot_x(40 * kRadPerDeg) * rot_z(-20 * kRadPerDeg), Vec3(100, -50, 7)};
  EXPECT_NEAR(distance_in(plate, X * Vec3(13, 5, -4)), 3, 1e-12);
  EXPECT_NEAR(distance_in(plate, X * Vec3(13, 24, -4)), 5, 1e-12);
  EXPECT_NEAR(distance_in(plate, X * Vec3(12, 23, 6)), 7, 1e-12);
  EXPECT_NEAR(distance_in(plate, X * Vec3(1, 2, -33)), 3, 1e-12);
  EXPECT_NEAR(distance_in(plate, X * Vec3(8, 2, -4)), -2, 1e-12);
}

TEST(TouchShapes, ABoreIsAirWithAWallARimAndABottom) {
  const std::string plate =
      "[[plate]]\nmin_mm = [-30, -30, -20]\nmax_mm = [30, 30, 0]\n"
      "[[plate.bore]]\nx_mm = 5\ny_mm = -4\ndiameter_mm = 16\ndepth_mm = 12\n";
  EXPECT_NEAR(distance_in(plate, {5 + 3, -4, -6}), 5, 1e-12) << "wall";
  EXPECT_NEAR(distance_in(plate, {5, -4, -10}), 2, 1e-12) << "bottom";
  EXPECT_NEAR(distance_in(plate, {5, -4 + 5, 4}), 5, 1e-12) << "rim, 3 inwards and 4 above";
  EXPECT_NEAR(distance_in(plate, {5 - 9, -4, -6}), -1, 1e-12) << "in the metal";
  EXPECT_NEAR(distance_in(plate, {5, -4, -13}), -1, 1e-12);
  EXPECT_NEAR(distance_in(plate, {-20, -20, 3}), 3, 1e-12) << "beside the bore";
  const std::string through =
      "[[plate]]\nmin_mm = [-30, -30, -20]\nmax_mm = [30, 30, 0]\n"
      "[[plate.bore]]\nx_mm = 5\ny_mm = -4\ndiameter_mm = 16\n";
  EXPECT_NEAR(distance_in(through, {5, -4, -19}), 8, 1e-12);
  EXPECT_THROW(read_touch_shapes(parse_config("[[plate]]\nmin_mm = [0, 0, 0]\nmax_mm = [9, 9, 9]\n"
                                              "[[plate.bore]]\nx_mm = 5\ny_mm = 4\ndiameter_mm = 8\n",
                                              "io.toml")),
               ConfigError);
}

TEST(TouchShapes, BossesAndBallsAreRound) {
  const std::string boss = "[[boss]]\nat_mm = [10, 20, 30]\ndiameter_mm = 12\nheight_mm = 8\n";
  EXPECT_NEAR(distance_in(boss, {10 + 6, 20 + 8, 27}), 4, 1e-12);
  EXPECT_NEAR(distance_in(boss, {10, 20 - 9, 34}), 5, 1e-12) << "rim";
  EXPECT_NEAR(distance_in(boss, {11, 20, 35}), 5, 1e-12) << "top";
  EXPECT_NEAR(distance_in(boss, {10, 21, 20}), 2, 1e-12) << "below";
  const std::string ball = "[[ball]]\nat_mm = [1, 2, 3]\ndiameter_mm = 25\n";
  EXPECT_NEAR(distance_in(ball, Vec3(1, 2, 3) + 20 * Vec3(2, -3, 6) / 7), 7.5, 1e-12);
  EXPECT_NEAR(distance_in(ball + boss, {10, 21, 20}), 2, 1e-12) << "the nearest of all";
}

// The stylus' ball stands on the tip: from above it touches with the tip itself, from the side a radius
// early.
TEST(TouchTable, TheTipIsABall) {
  const LoadedMachine mill = load_machine("mill");
  const TouchTable table(
      table_of("[probe]\ntip_diameter_mm = 4\n[[plate]]\nmin_mm = [0, 0, -30]\nmax_mm = [9, "
               "9, 0]\n",
               mill),
      *mill.kinematics);
  const auto gap = [&](double x, double y, double z) {
    Words words = Words::Zero();
    words.head<3>() = Vec3(x, y, z + 50);
    JointVec q;
    EXPECT_EQ(mill.kinematics->joints_from_words(words, q), KinStatus::kOk);
    return table.gap(q, {0, 0, 50});
  };
  EXPECT_NEAR(gap(4, 4, 0.25), 0.25, 1e-12);
  EXPECT_NEAR(gap(12, 4, -10), 1, 1e-12);
  EXPECT_NEAR(gap(9 + 3, 9 + 4, -10), 3, 1e-12) << "a corner";
}

// The table is where its axes really are. A lies 0.02 mm too high: so does what lies on the table, while A
// stands at zero; turned by 90 degrees too, for the error is in front of the turn.
TEST(TouchTable, AxesLieWhereTheErrorsSay) {
  const LoadedMachine cradle = load_machine("cradle");
  const std::string ball = "[[ball]]\nat_mm = [0, 60, 0]\ndiameter_mm = 20\n";
  const TouchTable true_table(table_of(ball + "[[errors.axis]]\njoint = \"A\"\nez0_mm = 0.02\n", cradle),
                              *cradle.kinematics);
  const TouchTable ideal(table_of(ball, cradle), *cradle.kinematics);
  JointVec q = JointVec::Zero(5);
  q[1] = 60;
  q[2] = 10.5;
  EXPECT_NEAR(ideal.gap(q, Vec3::Zero()), 0.5, 1e-12);
  EXPECT_NEAR(true_table.gap(q, Vec3::Zero()), 0.48, 1e-12);
  const double up = ideal.gap((q + (JointVec(5) << 0, 0, 0, 0.3, 0).finished()).eval(), Vec3::Zero());
  JointVec moved = q + (JointVec(5) << 0, 0, 0, 0.3, 0).finished();
  moved[2] += 0.02;
  EXPECT_NEAR(true_table.gap(moved, Vec3::Zero()), up, 1e-12);
}

TEST(TouchSwitch, ClosesALittleElsewhereAtEveryTouch) {
  TouchSwitch exact({0, 1});
  EXPECT_FALSE(exact.closed(1e-9));
  EXPECT_TRUE(exact.closed(-1e-9));
  constexpr double kNoise = 0.001;
  constexpr int kTouches = 2000;
  TouchSwitch noisy({kNoise, 7});
  double sum = 0, squares = 0;
  for (int i = 0; i < kTouches; ++i) {
    double gap = 0.05;
    while (!noisy.closed(gap)) gap -= 1e-6;
    const double closed_at = gap + 0.5e-6;
    EXPECT_TRUE(noisy.closed(gap)) << "it stays closed";
    while (noisy.closed(gap)) gap += 1e-6;
    EXPECT_NEAR(gap - 0.5e-6, closed_at, 1.1e-6) << "and opens where it closed";
    sum += closed_at;
    squares += closed_at * closed_at;
    noisy.closed(1);
  }
  EXPECT_NEAR(sum / kTouches, 0, 5 * kNoise / std::sqrt(kTouches));
  EXPECT_NEAR(std::sqrt(squares / kTouches), kNoise, 5 * kNoise / std::sqrt(2.0 * kTouches));
}

}  // namespace
}  // namespace trn
