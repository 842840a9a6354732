#include "app/daemon/alarm_list.h"

#include <gtest/gtest.h>

#include <string>

namespace trn {
namespace {

Alarm alarm(const std::string& name, bool active = true, const std::string& text = "") {
  Alarm out;
  out.name = name;
  out.text = text;
  out.active = active;
  return out;
}

TEST(AlarmList, ShowsAnAlarmUntilItIsOverAndAcknowledgedInAnyOrder) {
  for (const bool over_first : {true, false}) {
    AlarmList list;
    list.raise(alarm("drive_lost"));
    EXPECT_TRUE(list.take_news());
    EXPECT_FALSE(list.take_news());
    over_first ? list.over("drive_lost") : static_cast<void>(list.acknowledge(0));
    ASSERT_EQ(list.alarms().size(), 1u);
    EXPECT_EQ(list.alarms()[0].active, !over_first);
    EXPECT_EQ(list.open(), over_first ? 1 : 0);
    over_first ? static_cast<void>(list.acknowledge(1)) : list.over();
    EXPECT_TRUE(list.alarms().empty());
    EXPECT_TRUE(list.take_news());
  }
}

TEST(AlarmList, CountsTheSameOneAgainAndTellsTheFirstTime) {
  AlarmList list;
  list.raise(alarm("starved", true, "late"));
  const std::int64_t since_us = list.alarms()[0].since_us;
  EXPECT_GT(since_us, 1'600'000'000'000'000) << "Unix time";
  list.over("starved");
  list.raise(alarm("starved", true, "late"));
  ASSERT_EQ(list.alarms().size(), 1u);
  EXPECT_EQ(list.alarms()[0].times, 2);
  EXPECT_EQ(list.alarms()[0].since_us, since_us);
  EXPECT_TRUE(list.alarms()[0].active);
  list.acknowledge(0);
  list.raise(alarm("starved", true, "late"));
  EXPECT_EQ(list.alarms().size(), 2u) << "nobody has seen this one";
}

TEST(AlarmList, AcknowledgesOneByItsNumber) {
  AlarmList list;
  list.raise(alarm("a", false, "1"));
  list.raise(alarm("b", false, "2"));
  EXPECT_FALSE(list.acknowledge(7));
  EXPECT_EQ(list.newest(), "b: 2");
  EXPECT_TRUE(list.acknowledge(2));
  EXPECT_EQ(list.newest(), "a: 1");
  EXPECT_EQ(list.message().alarm_count, 1);
}

TEST(AlarmList, IsBoundedAndItsMessageFitsIntoAPacket) {
  AlarmList list;
  for (int i = 0; i < 100; ++i) list.raise(alarm(std::to_string(i), i == 3, std::string(5000, 'x')));
  EXPECT_EQ(list.alarms().size(), AlarmList::kMax);
  EXPECT_EQ(list.alarms().front().name, "3") << "it lasts";
  EXPECT_EQ(list.alarms().back().name, "99");
  EXPECT_LT(list.message().getEncodedSize(), 65000);
  for (int i = 0; i < 100; ++i) list.raise(alarm("f" + std::to_string(i)));
  EXPECT_EQ(list.alarms().size(), AlarmList::kMax);
}

TEST(FaultAlarm, TellsCureDetailAndWhatTheMachineDid) {
  const Alarm lost = fault_alarm(Fault::kDriveLost, "Y", "node 3 is silent", MachineState::kRunning);
  EXPECT_EQ(lost.name, "drive_lost");
  EXPECT_EQ(lost.text, "a drive no longer answers; joint Y; node 3 is silent");
  EXPECT_EQ(lost.cure, "check its supply and cabling, then reset");
  EXPECT_EQ(lost.did,
            "the drives braked, each by its own ramp, and lost their power; the program was given up");
  EXPECT_EQ(fault_alarm(Fault::kJointLimit, "", "", MachineState::kIdle).did, "nothing moved");
  EXPECT_EQ(fault_alarm(Fault::kStarved, "", "", MachineState::kRunning).did, "the machine went on");
}

}  // namespace
}  // namespace trn
