#include "sim/touch_plates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/config.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

std::vector<TouchPlates::Plate> plates_of(const std::string& text) {
  return read_plates(parse_config(text, "io.toml"));
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
TEST(TouchPlates, AreTouchedInsideAndOnTheirFaces) {
  const LoadedMachine mill = load_machine("mill");
  const TouchPlates plates(plates_of(kTwo), *mill.kinematics);
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
TEST(TouchPlates, AreTouchedByTheTipAndNotByTheNose) {
  const LoadedMachine mill = load_machine("mill");
  const TouchPlates plates(plates_of(kTwo), *mill.kinematics);
  Words words = Words::Zero();
  words.head<3>() = Vec3(20, 30, -10);
  JointVec q;
  ASSERT_EQ(mill.kinematics->joints_from_words(words, q), KinStatus::kOk);
  EXPECT_TRUE(plates.touches(q, {0, 0, 19.9}));
  EXPECT_FALSE(plates.touches(q, {0, 0, 20.1}));
  EXPECT_FALSE(plates.touches(q, {0, 0, -5.1}));
}

TEST(TouchPlates, NoneAreNeverTouched) {
  const LoadedMachine mill = load_machine("mill");
  const TouchPlates plates(plates_of(""), *mill.kinematics);
  EXPECT_TRUE(plates.empty());
  EXPECT_FALSE(plates.touches(JointVec::Zero(mill.kinematics->joint_count()), Vec3::Zero()));
}

TEST(TouchPlates, AFlatOneIsRefused) {
  for (const char* max : {"[10, 50, -5]", "[40, 20, -5]", "[40, 50, -31]"}) {
    const std::string text = std::string("[[plate]]\nmin_mm = [10, 20, -30]\nmax_mm = ") + max + "\n";
    EXPECT_THROW(plates_of(text), ConfigError) << max;
  }
}

}  // namespace
}  // namespace trn
