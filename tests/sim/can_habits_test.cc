#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/axes.h"
#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/frame.h"
#include "sim/canopen/emulated_node.h"
#include "tests/sim/can_field.h"
#include "tests/support/eds_sheet.h"

// Drives that do otherwise than CiA 402 has it: the emulated drive has the habit, the config says it.
namespace trn {
namespace {

Edits with(const std::string& sheet, const std::string& more = "") {
  Edits edits = {{"eds/servo.eds", sheet_file(sheet)}};
  if (!more.empty()) edits.emplace_back("homing_method = 5", "homing_method = 5\n" + more);
  return edits;
}

std::string mode_sheet(const std::string& mapped, bool display = true) {
  return sheet_text({"6060", "6061"}, variable("6060", "2", "rw", "0", mapped) +
                                          (display ? variable("6061", "2", "ro", "0", mapped) : ""));
}

/// Homes and follows to the count.
void work(Field& field) {
  field.start();
  field.home();
  field.setpoints.qd = JointVec::Constant(5, 0.3);
  for (int i = 0; i < 300; ++i) field.tick();
  ASSERT_TRUE(field.enabled()) << field.drives.explain_fault(-1);
  field.setpoints.qd.setZero();
  field.settle();
  EXPECT_EQ(field.feedback.fault, Fault::kOk) << field.drives.explain_fault(-1);
  EXPECT_NEAR(field.node(0).drive().joint().measured(), field.setpoints.q[0], 3e-4);
}

TEST(CanHabits, ModesThatGoInNoPdoGoBySdo) {
  Field field("cradle_can.toml", with(mode_sheet("")));
  std::vector<int> told;
  field.bus().on_frame([&](const CanFrame& frame) {
    if (frame.id == 0x601 && frame.data[1] == 0x60 && frame.data[2] == 0x60) told.push_back(frame.data[4]);
  });
  work(field);
  EXPECT_EQ(told, (std::vector<int>{8, 6, 8})) << "bring-up, homing, and back";
  EXPECT_EQ(field.node(0).store().integer({0x6061, 0}), 8);
}

// Another tool takes the drive out of its mode: seen by the next look, within 50 periods and an answer.
TEST(CanHabits, AModeThatIsAskedForBySdoIsStillWatched) {
  Field field("cradle_can.toml", with(mode_sheet("")));
  work(field);
  field.node(1).store().set({0x6060, 0}, 3);
  EXPECT_GE(field.until([&] { return field.feedback.fault != Fault::kOk; }, 60), 0);
  EXPECT_EQ(field.feedback.fault, Fault::kDriveDropped);
}

TEST(CanHabits, ADriveWithoutAModeDisplayIsBelieved) {
  Field field("cradle_can.toml", with(mode_sheet("PDOMapping=1\n", false)));
  work(field);
  Field by_sdo("cradle_can.toml", with(mode_sheet("", false)));
  work(by_sdo);
  Field lying("cradle_can.toml", with(sheet_text({}), "[drives.node.habits]\nmode_display = false"));
  work(lying);
}

TEST(CanHabits, ADriveThatNeverSaysReachedHomesWithBit12) {
  Field told("cradle_can.toml", with(sheet_text({}), "[drives.node.habits]\nhoming_reached = false"));
  work(told);
  Field untold("cradle_can.toml", {});
  untold.start();
  untold.node(0).drive().habits().homing_reached = false;
  untold.drives.request_home(1);
  untold.tick();
  EXPECT_EQ(untold.until([&] { return untold.enabled(); }, 3000), -1) << "waits for bit 10 for ever";
}

TEST(CanHabits, ADriveThatChangesItsModeAtAStandstillOnly) {
  Field field("cradle_can.toml", with(sheet_text({}), "[drives.node.habits]\nstands_to_switch = true"));
  work(field);
}

TEST(CanHabits, AHomeOffsetThatIsTheZerosPlace) {
  for (const char* habit : {"position", "zero"}) {
    Field field("cradle_can.toml",
                with(sheet_text({}),
                     "home_mm = 12.5\n[drives.node.habits]\nhome_offset = \"" + std::string(habit) + "\""));
    field.start();
    field.home();
    EXPECT_EQ(field.node(0).store().integer({0x607C, 0}), *habit == 'z' ? -125'000 : 125'000);
    EXPECT_NEAR(field.feedback.q[0], field.node(0).drive().joint().true_place(), 2e-4);
  }
}

TEST(CanHabits, ADriveThatIgnoresItsSetpointsIsAFaultThatSaysSo) {
  Field field("cradle_can.toml");
  work(field);
  field.setpoints.qd = JointVec::Constant(5, 0.3);
  for (int i = 0; i < 20; ++i) field.tick();
  field.trouble(2, EmulatedNode::Trouble::kIgnore, 1);
  const int periods = field.until([&] { return field.feedback.fault != Fault::kOk; }, 20);
  EXPECT_EQ(field.feedback.fault, Fault::kDriveIgnores);
  EXPECT_GE(periods, 6) << "debounced";
  EXPECT_LE(periods, 10);
  EXPECT_EQ(field.feedback.fault_joint, 2);
  EXPECT_NE(field.drives.explain_fault(2).find("internal limit"), std::string::npos)
      << field.drives.explain_fault(2);
}

TEST(CanHabits, ADriveThatNeverSetsTheBitIsNotWatchedByIt) {
  Field field("cradle_can.toml");
  for (int i = 0; i < 5; ++i) field.node(i).drive().habits().follows_bit = false;
  work(field);
}

TEST(CanHabits, AnErrorCodeIsReadWhenNoEmergencyMessageCame) {
  Field field("cradle_can.toml");
  work(field);
  field.trouble(2, EmulatedNode::Trouble::kQuietFault, 0x3210);
  field.until([&] { return field.feedback.fault != Fault::kOk; }, 10);
  EXPECT_EQ(field.feedback.fault, Fault::kDriveFault);
  for (int i = 0; i < 5; ++i) field.tick();
  EXPECT_NE(field.drives.explain_fault(2).find("error code 0x603F = 0x3210 (DC link over-voltage)"),
            std::string::npos)
      << field.drives.explain_fault(2);
}

TEST(CanHabits, TorqueIsTold) {
  Field field("cradle_can.toml", with(sheet_text({}), "torque = true"));
  work(field);
  field.node(2).store().set({0x6077, 0}, -345);
  for (int i = 0; i < 30; ++i) field.tick();
  field.trouble(2, EmulatedNode::Trouble::kFault, 0x3210);
  field.until([&] { return field.feedback.fault != Fault::kOk; }, 10);
  EXPECT_NE(field.drives.explain_fault(2).find("torque -34.5 % of the rated"), std::string::npos)
      << field.drives.explain_fault(2);
}

}  // namespace
}  // namespace trn
