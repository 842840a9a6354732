#include "hal/can/gantry_config.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "core/config.h"
#include "core/machine.h"
#include "core/units.h"
#include "hal/can/brake.h"
#include "hal/can/can_config.h"
#include "tests/support/paths.h"

// configs/gantry_router.toml, section by section, and changed ones.
namespace trn {
namespace {

const std::string kFile = source_dir() + "/configs/gantry_router.toml";

/// `change` gets every section of the file, and may empty it.
CanDrivesConfig router(const std::function<void(std::string&)>& change) {
  std::ifstream in(kFile);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  std::string text;
  for (std::size_t from = 0; from < whole.size();) {
    const std::size_t end = std::min(whole.find("\n[", from), whole.size());
    std::string section = whole.substr(from, end + 1 - from);
    change(section);
    text += section;
    from = end + 1;
  }
  const ConfigTable root = parse_config(text, kFile);
  return read_can_drives(read_machine(root), root.table("drives"));
}

bool has(const std::string& section, const std::string& text) {
  return section.find(text) != std::string::npos;
}

void replace(std::string& text, const std::string& old, const std::string& by) {
  for (std::size_t at = text.find(old); at != std::string::npos; at = text.find(old, at + by.size()))
    text.replace(at, old.size(), by);
}

/// As long as the gantry turns: degrees for mm.
void make_rotary(std::string& section) {
  if (!has(section, "joint = \"Y\"") && !has(section, "name = \"Y\"")) return;
  replace(section, "linear", "rotary");
  replace(section, "_mm", "_deg");
}

TEST(GantryConfig, ItsFiguresAreThoseOfTheFile) {
  const CanDrivesConfig config = router([](std::string&) {});
  EXPECT_EQ(config.buses.at(0).bitrate, 1e6) << "the file does not say it";
  const Gantry::Config& gantry = config.gantries.at(0);
  EXPECT_EQ(gantry.motors, 2);
  EXPECT_DOUBLE_EQ(gantry.apart_max, 1);
  EXPECT_DOUBLE_EQ(gantry.apart_homing_max, 5);
  EXPECT_DOUBLE_EQ(gantry.squaring.speed, 2);
  EXPECT_DOUBLE_EQ(gantry.squaring.acceleration, 1000) << "half of the joint's";
  EXPECT_DOUBLE_EQ(gantry.home_final, -1240);
  EXPECT_DOUBLE_EQ(gantry.final.acceleration, 1000);
}

TEST(GantryConfig, WhileHomingFiveTimesAsMuchMayPartUnlessTheFileSays) {
  for (const bool rotary : {false, true}) {
    const CanDrivesConfig config = router([&](std::string& section) {
      replace(section, "apart_mm = 1.0", "apart_mm = 0.5");
      replace(section, "apart_homing_mm = 5.0", "");
      if (rotary) make_rotary(section);
    });
    const double unit = rotary ? kRadPerDeg : 1;
    EXPECT_DOUBLE_EQ(config.gantries.at(0).apart_max, 0.5 * unit);
    EXPECT_DOUBLE_EQ(config.gantries.at(0).apart_homing_max, 2.5 * unit);
    EXPECT_DOUBLE_EQ(config.gantries.at(0).squaring.speed, 2 * unit);
  }
}

TEST(GantryConfig, OneMotorIsNoGantry) {
  try {
    router([](std::string& section) {
      if (has(section, "id = 3")) section.clear();
    });
    FAIL() << "taken with one motor";
  } catch (const ConfigError& error) {
    EXPECT_TRUE(has(error.what(), "a gantry has 2 to 4 motors; there is 1 [[drives.node]] of joint Y"))
        << error.what();
  }
}

// The brake of Z: 0.08 s to let go, 0.06 s to close, and 200 mm/s at 2000 mm/s^2 is 0.1 s, and half a second
// more.
TEST(NodeSafetyConfig, ABrakeWaitsAsLongAsAQuickStopTakes) {
  const CanDrivesConfig config = router([](std::string&) {});
  const Brake::Config& brake = config.buses.at(0).nodes.at(0).link.brake;
  EXPECT_TRUE(brake.fitted);
  EXPECT_EQ(brake.release_periods, 40u);
  EXPECT_EQ(brake.close_periods, 30u);
  EXPECT_EQ(brake.stop_periods_max, 300u);
}

}  // namespace
}  // namespace trn
