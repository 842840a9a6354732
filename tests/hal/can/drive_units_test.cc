#include "hal/can/drive_units.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "hal/can/setup_steps.h"
#include "tests/support/eds_sheet.h"

// Figures by hand: a revolution has 50,000 counts unless a test says otherwise, so 4 revolutions a second are
// 200,000 counts/s and 240 rpm.
namespace trn {
namespace {

ObjectDictionary sheet(const std::string& text) { return parse_eds(text, "x.eds", 1); }

DriveUnitWish wish(const std::string& velocity, double counts_per_revolution = 0) {
  DriveUnitWish out;
  out.velocity = velocity;
  out.counts_per_revolution = counts_per_revolution;
  return out;
}

TEST(DriveUnits, WithoutAnyTheyAreCounts) {
  const DriveUnits units = drive_units({}, sheet(sheet_text({})));
  EXPECT_EQ(units.velocity_at_most(200'000), 200'000);
  EXPECT_EQ(units.velocity_at_most(-200'000), 200'000);
  EXPECT_EQ(units.acceleration_of(123'456), 123'456);
  EXPECT_TRUE(units.objects.empty());
}

TEST(DriveUnits, AreThoseOfTheDataSheet) {
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0x00B44700"))).velocity_at_most(200'000), 240);
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0xFFB44700"))).velocity_at_most(200'000), 2'400);
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0xFDB44700"))).velocity_at_most(200'000), 240'000);
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0x00B40300"))).velocity_at_most(200'000), 4);
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0x00410300"))).velocity_at_most(200'000), 1'440) << "deg/s";
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet("0x00B50300"))).velocity_at_most(200'000), 200'000);
  EXPECT_EQ(drive_units({}, sheet(rpm_sheet())).acceleration_of(50'000), 60) << "rpm a second";
}

TEST(DriveUnits, ARevolutionIsOfEncoderGearFeedOrThePositionsOwnUnit) {
  const auto rpm = [](const std::string& more, const std::string& without = "none") {
    return drive_units({}, sheet(sheet_text({without}, variable("60A9", "7", "rw", "0x00B44700") + more)))
        .velocity_at_most(200'000);
  };
  const auto pair = [](const std::string& index, const std::string& over, const std::string& under) {
    return record(index,
                  variable(index + "sub1", "7", "rw", over) + variable(index + "sub2", "7", "rw", under));
  };
  EXPECT_EQ(rpm(pair("608F", "50000", "1")), 240);
  EXPECT_EQ(rpm(pair("608F", "50000", "1") + pair("6091", "5", "1")), 48) << "of the shaft behind the gear";
  EXPECT_EQ(rpm(pair("608F", "50000", "1") + pair("6092", "2000", "1")), 6'000);
  EXPECT_EQ(rpm(pair("608F", "50000", "1") + variable("60A8", "7", "rw", "0xFF410000")), 3'333)
      << "a tenth of a degree: 3600 a revolution, rounded down";
  EXPECT_EQ(rpm(pair("608F", "50000", "1") + variable("60A8", "7", "rw", "0xFDB40000")), 12'000);
}

TEST(DriveUnits, TheConfigHasTheLastWord) {
  EXPECT_EQ(drive_units(wish("0.1 rpm", 1'000), sheet(sheet_text({}))).velocity_at_most(1'000), 600);
  EXPECT_EQ(drive_units(wish("0.1 rpm"), sheet(rpm_sheet())).velocity_at_most(200'000), 2'400);
  EXPECT_EQ(drive_units(wish("250 counts/s"), sheet(rpm_sheet())).velocity_at_most(200'000), 800);
  EXPECT_EQ(drive_units(wish("", 25'000), sheet(rpm_sheet())).velocity_at_most(200'000), 480);
  DriveUnitWish linear = wish("mm/s");
  linear.counts_per_m = 10'000'000;
  linear.acceleration = "m/s^2";
  EXPECT_EQ(drive_units(linear, sheet(sheet_text({}))).velocity_at_most(200'000), 20);
  EXPECT_EQ(drive_units(linear, sheet(sheet_text({}))).acceleration_of(50'000'000), 5);
}

TEST(DriveUnits, TheDriveIsToldOrAskedForThem) {
  const auto of = [](const DriveUnits& units, ObjectKey key) {
    for (const DriveUnits::Object& object : units.objects)
      if (object.key == key) return object;
    return DriveUnits::Object{};
  };
  const DriveUnits units = drive_units(wish("0.01 rpm"), sheet(rpm_sheet()));
  EXPECT_EQ(of(units, {0x60A9, 0}).value, 0xFEB44700);
  EXPECT_TRUE(of(units, {0x60A9, 0}).written);
  EXPECT_EQ(of(units, {0x60AA, 0}).value, 0x00C00300);
  EXPECT_EQ(of(units, {0x608F, 1}).value, 50'000);
  EXPECT_FALSE(of(units, {0x608F, 1}).written) << "an encoder is what it is";
  EXPECT_FALSE(of(drive_units({}, sheet(rpm_sheet("0x00B44700", "ro"))), {0x60A9, 0}).written);
}

TEST(DriveUnits, WhatCannotBeKnownIsAskedFor) {
  const auto refusal = [](const DriveUnitWish& wanted, const std::string& text) {
    try {
      drive_units(wanted, sheet(text));
    } catch (const DriveUnitError& error) {
      return error.key + ": " + error.what();
    }
    return std::string();
  };
  EXPECT_EQ(refusal(wish("rpm"), sheet_text({})).find("counts_per_revolution: "), 0u);
  EXPECT_EQ(refusal(wish("furlong/s"), sheet_text({})).find("velocity_unit: 'furlong/s' is no unit; legal: "),
            0u);
  EXPECT_EQ(refusal(wish("-1 rpm"), sheet_text({})).find("velocity_unit: "), 0u);
  EXPECT_EQ(refusal(wish("mm/s"), sheet_text({})).find("velocity_unit: "), 0u) << "of a joint that turns";
  EXPECT_EQ(refusal({}, rpm_sheet("0x00AC0300")).find("velocity_unit: the unit 0x00AC0300 of 0x60A9:0"), 0u);
  const std::string factor =
      record("6096", variable("6096sub1", "7", "rw", "3") + variable("6096sub2", "7", "rw", "2"));
  EXPECT_EQ(refusal({}, sheet_text({}, factor)).find("velocity_unit: 0x6096 is 3/2"), 0u);
  EXPECT_EQ(refusal(wish("counts/s"), sheet_text({}, factor)), "");
}

TEST(DriveUnits, AFactorOfOneIsWrittenSoThatItStaysOne) {
  const std::string factor =
      record("6096", variable("6096sub1", "7", "rw", "1") + variable("6096sub2", "7", "rw", "1"));
  int found = 0;
  for (const DriveUnits::Object& object :
       drive_units(wish("counts/s"), sheet(sheet_text({}, factor))).objects)
    if (object.key.index == 0x6096) {
      EXPECT_EQ(object.value, 1);
      EXPECT_TRUE(object.written) << to_string(object.key);
      ++found;
    }
  EXPECT_EQ(found, 2);
}

}  // namespace
}  // namespace trn
