#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "compensation/screw_correction.h"
#include "compensation/sensor_board.h"
#include "core/config.h"
#include "tests/kinematics/machines.h"

namespace trn {
namespace {

const std::string kScrewX =
    "[[screw.axis]]\njoint = \"X\"\nmounting = \"fixed-free\"\nfixed_bearing_mm = -3000\nfar_bearing_mm = "
    "3000\n";

ScrewCorrectionConfig read(const std::string& keys, const std::string& axes = kScrewX) {
  SensorBoard board;
  const ConfigTable root = parse_config("[screw]\n" + keys + "\n" + axes, "t");
  return read_screws(load_machine("cradle").machine, root.table("screw"), board);
}

std::string refusal(const std::string& keys, const std::string& axes = kScrewX) {
  try {
    read(keys, axes);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(ScrewConfig, UnitsAndDefaults) {
  const ScrewCorrectionConfig none = read(""), header;
  EXPECT_EQ(none.update_s, header.update_s);
  EXPECT_EQ(none.slope_max, header.slope_max);
  EXPECT_DOUBLE_EQ(none.rate_mm_s, header.rate_mm_s);
  EXPECT_EQ(none.period_s, load_machine("cradle").machine.period_s);
  EXPECT_DOUBLE_EQ(read("rate_um_s = 20").rate_mm_s, 0.02);
  ASSERT_EQ(none.screws.size(), 1u);
  EXPECT_EQ(none.screws[0].sensor.channel, -1);
  EXPECT_EQ(none.screws[0].stretch_mm, 0);
}

TEST(ScrewConfig, RangesHoldAtTheirEnds) {
  struct Row {
    std::string key, least, most, below, above;
  };
  const Row rows[] = {{"rate_um_s", "0.01", "100", "0.0099", "100.5"},
                      {"update_s", "0.1", "60", "0.09", "60.5"},
                      {"slope_max", "1e-6", "0.01", "0.9e-6", "0.0101"}};
  for (const Row& row : rows) {
    for (const std::string& legal : {row.least, row.most})
      EXPECT_EQ(refusal(row.key + " = " + legal), "") << row.key;
    for (const std::string& bad : {row.below, row.above})
      EXPECT_NE(refusal(row.key + " = " + bad).find(row.key), std::string::npos) << row.key << " = " << bad;
  }
}

TEST(ScrewConfig, TheJointLiesBetweenItsBearings) {  // X of the cradle: -400 to 400 mm
  const auto between = [](const std::string& fixed, const std::string& far) {
    return refusal("", "[[screw.axis]]\njoint = \"X\"\nmounting = \"fixed-free\"\nfixed_bearing_mm = " +
                           fixed + "\nfar_bearing_mm = " + far + "\n");
  };
  EXPECT_EQ(between("-400", "400"), "");
  EXPECT_EQ(between("400", "-400"), "") << "from either end";
  EXPECT_NE(between("-399.9", "400").find("between the two bearings"), std::string::npos);
  EXPECT_NE(between("-400", "399.9").find("between the two bearings"), std::string::npos);
  EXPECT_NE(refusal("", kScrewX + kScrewX).find("this joint has its screw already"), std::string::npos);
}

TEST(ScrewConfig, ASensorSitsInTheMiddleUnlessToldOtherwise) {
  const ScrewSensor sensor = read("", kScrewX + "sensor = \"x\"\n").screws[0].sensor;
  EXPECT_EQ(sensor.channel, 0);
  EXPECT_EQ(sensor.at_mm, 3000);
  EXPECT_FALSE(sensor.hold_on_dropout);
  EXPECT_EQ(read("", kScrewX + "sensor = \"x\"\nsensor_at_mm = 6000\non_dropout = \"hold\"\n")
                .screws[0]
                .sensor.at_mm,
            6000);
  EXPECT_NE(refusal("", kScrewX + "sensor = \"x\"\nsensor_at_mm = 6001\n"), "");
}

}  // namespace
}  // namespace trn
