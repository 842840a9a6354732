#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/axes.h"
#include "core/config.h"
#include "core/units.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"
#include "tests/support/eds_sheet.h"

// Drives that count in revolutions a minute: the master against emulated drives that reckon their units from
// their own objects. 10,000 counts a millimetre and 50,000 a revolution are 5 mm a revolution.
namespace trn {
namespace {

Edits by_sheet(const std::string& text, const std::string& more = "") {
  Edits edits = {{"eds/servo.eds", sheet_file(text)}};
  if (!more.empty()) edits.emplace_back("homing_method = 5", "homing_method = 5\n" + more);
  return edits;
}

/// Speed of node 0 on its way to the switch, 61 mm away, in mm/s.
double homing_speed(Field& field) {
  Speedometer speed(500);
  field.drives.request_home(31);
  field.tick();
  field.until(
      [&] {
        speed.take(field.node(0).drive().joint().true_place(), field.period_s());
        return field.enabled() && field.feedback.homed_mask == 31;
      },
      40000);
  return speed.fastest();
}

TEST(CanUnits, ADriveOfRevolutionsAMinuteHomesAtTheSpeedOfTheConfig) {
  Field field("cradle_can.toml", by_sheet(rpm_sheet(), "home_mm = -60"));
  field.start();
  EXPECT_EQ(field.node(0).store().integer({0x6099, 1}), 240) << "20 mm/s";
  EXPECT_EQ(field.node(0).store().integer({0x6099, 2}), 24) << "2 mm/s";
  EXPECT_EQ(field.node(0).store().integer({0x609A, 0}), 60'000) << "5000 mm/s^2";
  EXPECT_EQ(field.node(0).store().integer({0x6085, 0}), 120'000);
  EXPECT_EQ(field.node(3).store().integer({0x6099, 1}), 120) << "10 deg/s";
  EXPECT_NEAR(homing_speed(field), 20, 0.1);
  EXPECT_EQ(field.feedback.homed_mask, 31u) << field.drives.explain_fault(-1);
  EXPECT_TRUE(field.drives.warnings().empty());
}

// The drive's encoder has twice as many counts as the config says, so it goes half as fast.
TEST(CanUnits, AWrongFactorShowsAsAWrongSpeed) {
  Field field("cradle_can.toml", by_sheet(rpm_sheet(), "counts_per_revolution = 100000\nhome_mm = -60"));
  field.start();
  EXPECT_EQ(field.node(0).store().integer({0x6099, 1}), 120);
  EXPECT_NEAR(homing_speed(field), 10, 0.1);
}

TEST(CanUnits, UnitsThatCannotBeWrittenAreCompared) {
  Field field("cradle_can.toml", by_sheet(rpm_sheet("0x00B44700", "ro")));
  field.tick();
  field.node(1).store().set({0x60A9, 0}, 0xFFB44700);
  try {
    field.drives.bring_up();
    FAIL() << "a drive of another unit came up";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("node 2 (joint Y): 0x60A9:0"), std::string::npos)
        << error.what();
  }
}

// No limit in its data sheet, and units that it tells: never above the joint's own 500 mm/s.
TEST(CanUnits, NoHomingSpeedIsAboveTheJointsLimit) {
  Field field("cradle_can.toml",
              by_sheet(sheet_text({}, variable("60A9", "7", "rw", "0xFDB44700")),
                       "homing_speed_mm_s = 1e6\nindex_speed_mm_s = 1e6\ncounts_per_revolution = 50000"));
  field.start();
  // 500 mm/s are 100 revolutions a second, 6000 rpm.
  EXPECT_EQ(field.node(0).store().integer({0x6099, 1}), 6'000'000);
  EXPECT_EQ(field.node(0).store().integer({0x6099, 2}), 6'000'000);
}

TEST(CanUnits, AUnitThatIsTooCoarseIsRefused) {
  try {
    const Field field("cradle_can.toml", by_sheet(rpm_sheet(), "index_speed_mm_s = 0.01"));
    FAIL() << "less than one rpm was told";
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what())
                  .find("one of the drive's units of velocity is faster than index_speed_mm_s"),
              std::string::npos)
        << error.what();
  }
}

// 0.01 rpm are 0.0008 mm/s: the master's own position loop in the drive's velocities.
TEST(CanUnits, CyclicVelocityIsInTheDrivesUnits) {
  Field field("cradle_can.toml", by_sheet(rpm_sheet("0xFEB44700"), "mode = \"csv\""));
  field.start();
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.3);
  field.setpoints.qd[0] = 25;
  for (int i = 0; i < 400; ++i) field.tick();
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  // 25 mm/s are 5 revolutions a second, 300 rpm.
  EXPECT_NEAR(static_cast<double>(field.node(0).store().integer({0x60FF, 0})), 30'000, 300);
  EXPECT_NEAR(static_cast<double>(field.node(0).store().integer({0x606C, 0})), 30'000, 300);
  field.setpoints.qd.setZero();
  field.settle();
  for (int i = 0; i < 5; ++i) {
    const double scale = i < 3 ? 10000 : 10000 * kDegPerRad;
    EXPECT_NEAR(field.node(i).drive().joint().measured(), field.setpoints.q[i], 3 / scale) << "joint " << i;
  }
}

class MethodsInTheField : public testing::TestWithParam<int> {};

// Each on a drive of either direction; what the encoder reads then is the true place.
TEST_P(MethodsInTheField, ReadTheTruePlaceAfterwards) {
  const std::string method = "homing_method = " + std::to_string(GetParam());
  for (const char* more : {"", "\nreverse = true"}) {
    Field field("cradle_can.toml", {{"homing_method = 5", method + more + "\nhome_mm = 12.5"}});
    field.start();
    field.home();
    for (int i = 0; i < 5; ++i)
      EXPECT_NEAR(field.feedback.q[i], field.node(i).drive().joint().true_place(), 2e-4)
          << more << " joint " << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Of402, MethodsInTheField, testing::Values(3, 4, 5, 6, 19, 20, 21, 22));

}  // namespace
}  // namespace trn
