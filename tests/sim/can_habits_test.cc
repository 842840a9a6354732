#include <gtest/gtest.h>

#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/ports.h"
#include "hal/can/frame.h"
#include "hal/can/pdo.h"
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

/// What a bring-up of a machine says whose first drive has these habits, and whose config says `keys`.
std::string bring_up(const PdoHabits& drive, const Edits& edits) {
  Field field("cradle_can.toml", edits);
  field.node(0).store().set_pdo_habits(drive);
  try {
    field.drives.bring_up();
  } catch (const std::exception& error) {
    return error.what();
  }
  return field.until([&] { return field.enabled(); }, kReady) >= 0 ? "" : field.drives.explain_fault(-1);
}

// CiA 301, table 22: 0x08000022, not in this state of the device. Each order is taken by a drive that wants
// it, and by no drive that wants another.
TEST(CanHabits, PdosAreMappedInTheOrderThatTheDriveWants) {
  using W = PdoWrite;
  const std::vector<std::pair<PdoOrder, std::string>> orders = {
      {{W::kOff, W::kType, W::kClear, W::kMap, W::kCount, W::kOn}, ""},
      {{W::kOff, W::kClear, W::kMap, W::kCount, W::kType, W::kOn},
       "pdo_order = [\"off\", \"clear\", \"map\", \"count\", \"type\", \"on\"]"},
      {{W::kOff, W::kClear, W::kType, W::kMap, W::kCount, W::kOn},
       "pdo_order = [\"off\", \"clear\", \"type\", \"map\", \"count\", \"on\"]"},
      {{W::kClear, W::kOff, W::kMap, W::kCount, W::kOn, W::kType},
       "pdo_order = [\"clear\", \"off\", \"map\", \"count\", \"on\", \"type\"]"}};
  for (const auto& [drive, unused] : orders)
    for (const auto& [told, keys] : orders) {
      PdoHabits habits;
      habits.strict = true;
      habits.order = drive;
      const std::string said =
          bring_up(habits, with(sheet_text({}), keys.empty() ? "" : "[drives.node.habits]\n" + keys));
      if (drive == told) {
        EXPECT_EQ(said, "") << keys;
        continue;
      }
      EXPECT_NE(said.find("can0 node 1 (joint X): writing 0x1"), std::string::npos) << said;
      EXPECT_NE(said.find("SDO abort 0x08000022"), std::string::npos) << said;
      EXPECT_NE(said.find("'pdo_order'"), std::string::npos) << said;
    }
}

/// The control word alone in the first RPDO, status word and temperature of nobody in the first TPDO, for
/// good.
std::string fixed_sheet(const std::string& rpdo = "0x60400010") {
  const auto mapping = [](const std::string& index, const std::vector<std::string>& entries) {
    std::string subs = variable(index + "sub0", "5", "ro", std::to_string(entries.size()));
    for (std::size_t i = 0; i < entries.size(); ++i)
      subs += variable(index + "sub" + std::to_string(i + 1), "7", "ro", entries[i]);
    return record(index, subs);
  };
  return sheet_text({"1600", "1A00"},
                    mapping("1600", {rpdo}) + mapping("1A00", {"0x60410010", "0x60710010"}));
}

TEST(CanHabits, PdosThatCannotBeMappedAreUsedAsTheyAre) {
  PdoHabits drive;
  drive.fixed_rpdos = drive.fixed_tpdos = 1;
  const std::string keys = "fixed_pdos = [\"RPDO1\", \"TPDO1\"]";
  // More frames than a period of 2 ms has room for.
  const auto slower = [](Edits edits) {
    edits.emplace_back("period_s = 0.002", "period_s = 0.004");
    return edits;
  };
  const Edits told = slower(with(fixed_sheet(), "[drives.node.habits]\n" + keys));
  const std::string without = bring_up(drive, slower(with(fixed_sheet())));
  EXPECT_NE(without.find("0x1600:0"), std::string::npos) << without;
  EXPECT_NE(without.find("SDO abort 0x06010002"), std::string::npos) << without;
  EXPECT_NE(without.find("'fixed_pdos'"), std::string::npos) << without;
  EXPECT_EQ(bring_up(drive, told), "");
  Field field("cradle_can.toml", told);
  field.node(0).store().set_pdo_habits(drive);
  work(field);
  const std::vector<Pdo>& rpdos = field.drives.config().buses[0].nodes[0].link.rpdos;
  int pdo = -1;
  PdoField place;
  ASSERT_TRUE(find_field(rpdos, {0x6040, 0}, pdo, place));
  EXPECT_TRUE(rpdos[static_cast<std::size_t>(pdo)].fixed);
  EXPECT_EQ(rpdos[static_cast<std::size_t>(pdo)].fields.size(), 1u);
  ASSERT_TRUE(find_field(rpdos, {0x607A, 0}, pdo, place));
  EXPECT_FALSE(rpdos[static_cast<std::size_t>(pdo)].fixed) << "the target has moved to another";
}

TEST(CanHabits, AFixedPdoThatNothingSetsIsRefused) {
  const auto refusal = [](const std::string& sheet, const std::string& keys) -> std::string {
    try {
      Field field("cradle_can.toml", with(sheet, "[drives.node.habits]\n" + keys));
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  const std::string fixed = "fixed_pdos = [\"RPDO1\"]";
  const std::string sets =
      refusal(sheet_text({"1600"}, record("1600", variable("1600sub0", "5", "ro", "2") +
                                                      variable("1600sub1", "7", "ro", "0x60400010") +
                                                      variable("1600sub2", "7", "ro", "0x60FF0020"))),
              fixed);
  EXPECT_NE(sets.find("RPDO1 is fixed and carries 0x60FF:0"), std::string::npos) << sets;
  const std::string empty = refusal(sheet_text({"1600"}), fixed);
  EXPECT_NE(empty.find("0x1600:0 does not tell how many"), std::string::npos) << empty;
  const std::string bits = refusal(fixed_sheet("0x60400007"), fixed);
  EXPECT_NE(bits.find("0x1600:1 = 0x60400007 is no object of whole bytes"), std::string::npos) << bits;
  for (const char* bad : {"[\"RPDO5\"]", "[\"rpdo1\"]", "[\"PDO1\"]", "[1]", "\"RPDO1\"", "[\"\"]"})
    EXPECT_NE(refusal(sheet_text({}), std::string("fixed_pdos = ") + bad), "") << bad;
  for (const char* bad :
       {"[\"off\", \"on\"]", "[]", "\"off\"", "[\"off\", \"type\", \"clear\", \"map\", \"count\", \"count\"]",
        "[\"on\", \"type\", \"clear\", \"map\", \"count\", \"off\"]",
        "[\"off\", \"type\", \"map\", \"clear\", \"count\", \"on\"]"})
    EXPECT_NE(refusal(sheet_text({}), std::string("pdo_order = ") + bad), "") << bad;
}

}  // namespace
}  // namespace trn
