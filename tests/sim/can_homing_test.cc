#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/fault.h"
#include "core/ports.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"
#include "tests/support/eds_sheet.h"

// What the master makes of several joints' homing: order, the move behind it, encoders that need none; and
// the drives' own limits.
namespace trn {
namespace {

double place(Field& field, int joint) { return field.node(joint).drive().joint().true_place(); }

/// Z before the others.
const Edits kZFirst = {{"joint = \"X\"\nid", "joint = \"X\"\nhome_group = 1\nid"},
                       {"joint = \"Y\"\nid", "joint = \"Y\"\nhome_group = 1\nid"},
                       {"joint = \"A\"\nid", "joint = \"A\"\nhome_group = 2\nid"},
                       {"joint = \"C\"\nid", "joint = \"C\"\nhome_group = 2\nid"}};

TEST(CanHoming, GroupsGoOneAfterTheOther) {
  Field field("cradle_can.toml", kZFirst);
  field.start();
  field.drives.request_home(31);
  std::vector<unsigned> seen = {0};
  for (int i = 0; i < 20000 && field.feedback.homed_mask != 31; ++i) {
    std::vector<double> before;
    for (int k = 0; k < 5; ++k) before.push_back(place(field, k));
    const unsigned homed = field.feedback.homed_mask;
    field.tick();
    if (field.feedback.homed_mask != 31) {
      EXPECT_EQ(field.feedback.state, DriveState::kHoming);
    }
    // Nobody moves before those in front of it are home.
    for (const int k : {0, 1}) {
      if (!(homed & 4)) {
        EXPECT_EQ(place(field, k), before[static_cast<std::size_t>(k)]);
      }
    }
    for (const int k : {3, 4}) {
      if ((homed & 7) != 7) {
        EXPECT_EQ(place(field, k), before[static_cast<std::size_t>(k)]);
      }
    }
    if (field.feedback.homed_mask != seen.back()) seen.push_back(field.feedback.homed_mask);
  }
  EXPECT_EQ(field.feedback.homed_mask, 31u) << field.drives.explain_fault(-1);
  EXPECT_EQ(seen[1], 4u) << "Z first, alone";
  EXPECT_GE(field.until([&] { return field.enabled(); }, 10), 0);
}

TEST(CanHoming, OneThatFailsStopsTheOthers) {
  Field field("cradle_can.toml", kZFirst);
  field.start();
  field.node(2).drive().joint().set_home_switch_dead(true);
  field.drives.request_home(31);
  const double x = place(field, 0);
  ASSERT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 20000), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kHomingFailed);
  EXPECT_EQ(field.feedback.fault_joint, 2);
  field.drives.quick_stop();  // as the tick does
  for (int i = 0; i < 500; ++i) field.tick();
  EXPECT_EQ(place(field, 0), x) << "those that waited do not begin";
  EXPECT_EQ(field.feedback.homed_mask, 0u);
  field.node(2).drive().joint().set_home_switch_dead(false);
  field.reset();
  field.tick();
  ASSERT_GE(field.until([&] { return field.enabled(); }, 400), 0) << field.drives.explain_fault(-1);
  for (int i = 0; i < 500; ++i) field.tick();
  EXPECT_EQ(place(field, 0), x);
}

class FinalMove : public testing::TestWithParam<const char*> {};

TEST_P(FinalMove, EndsWhereTheConfigWantsTheJoint) {
  Field field("cradle_can.toml",
              {{"homing_method = 5", "homing_method = 5\nhome_final_mm = 8\nhome_final_deg = -3\nmode = \"" +
                                         std::string(GetParam()) + "\""}});
  field.start();
  field.drives.request_home(31);
  Speedometer speed(150);
  ASSERT_GE(field.until(
                [&] {
                  speed.take(place(field, 0), field.period_s());
                  return field.enabled() && field.feedback.homed_mask == 31;
                },
                20000),
            0)
      << field.drives.explain_fault(-1);
  EXPECT_LT(speed.fastest(), 20.5) << "as fast as the search";
  field.settle();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(place(field, k), 8, 2e-3) << k;
  for (int k = 3; k < 5; ++k) EXPECT_NEAR(place(field, k), -3 * 3.14159265358979 / 180, 2e-3) << k;
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
}

INSTANTIATE_TEST_SUITE_P(Of402, FinalMove, testing::Values("csp", "csv", "ip", "pp"),
                         [](const auto& param) { return std::string(param.param); });

TEST(CanHoming, AnAbsoluteEncoderHasItsOffset) {
  Field field("cradle_can.toml",
              {{"joint = \"X\"\nid", "joint = \"X\"\nabsolute = true\nencoder_offset_mm = 123.4\nid"}});
  field.start();
  EXPECT_EQ(field.feedback.homed_mask, 1u);
  EXPECT_NEAR(field.feedback.q[0], place(field, 0), 1e-4);
  EXPECT_EQ(field.node(0).store().integer({0x6064, 0}), std::llround((place(field, 0) - 123.4) * 10000));
  field.home();
  field.setpoints.qd[0] = 5;
  for (int i = 0; i < 200; ++i) field.tick();
  field.setpoints.qd.setZero();
  field.settle();
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  EXPECT_NEAR(place(field, 0), field.setpoints.q[0], 3e-4);
  EXPECT_NEAR(field.feedback.q[0], place(field, 0), 1e-4);
}

std::string limited(const std::string& low, const std::string& high, const std::string& window) {
  return sheet_text(
      {}, record("607D", variable("607Dsub1", "4", "rw", low) + variable("607Dsub2", "4", "rw", high)) +
              variable("6065", "7", "rw", window) + variable("6072", "6", "rw", "1000"));
}

// X, Y: -400 to 400 mm at 10,000 counts a millimetre; following_error_mm = 10.
TEST(DriveLimits, ThoseThatAreTighterThanOursAreAWarning) {
  const auto warnings = [](const std::string& sheet) {
    Field field("cradle_can.toml", {{"joint = \"X\"\nid = 1\neds = \"eds/servo.eds\"",
                                     "joint = \"X\"\nid = 1\neds = \"" + sheet_file(sheet) + "\""}});
    field.start();
    return field.drives.warnings();
  };
  EXPECT_TRUE(warnings(limited("-4000000", "4000000", "100000")).empty());
  EXPECT_TRUE(warnings(limited("0", "0", "0xFFFFFFFF")).empty()) << "none";
  const auto tight = warnings(limited("-4000000", "3999999", "99999"));
  ASSERT_EQ(tight.size(), 2u);
  EXPECT_EQ(tight[0].find("can0 node 1 (joint X): 0x607D:2 'Record 607D: Object 607Dsub2' is 3999999; at "
                          "least 4000000 is needed"),
            0u)
      << tight[0];
  EXPECT_NE(tight[1].find("0x6065:0"), std::string::npos) << tight[1];
}

TEST(DriveLimits, AreSetWhenTheConfigSaysSo) {
  for (const char* reverse : {"", "\nreverse = true"}) {
    Field field("cradle_can.toml",
                {{"eds/servo.eds", sheet_file(limited("-1000", "1000", "10"))},
                 {"homing_method = 5", std::string("homing_method = 5\ndrive_limits = \"set\"") + reverse}});
    field.start();
    EXPECT_TRUE(field.drives.warnings().empty());
    EXPECT_EQ(field.node(2).store().integer({0x607D, 1}), *reverse ? -5'000'000 : -2'500'000)
        << "Z: -250 to 500 mm";
    EXPECT_EQ(field.node(2).store().integer({0x607D, 2}), *reverse ? 2'500'000 : 5'000'000);
    EXPECT_EQ(field.node(2).store().integer({0x6065, 0}), 100'000);
  }
}

}  // namespace
}  // namespace trn
