#include "kernel/tick_io.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "core/axes.h"

// Devices by hand: every period has its inputs, and the outputs are looked at.
namespace trn {
namespace {

using Kind = QueueEvent::Kind;
using Outcome = TickIo::Outcome;
constexpr double kPeriod = 0.01;

class Devices final : public MachineIo {
 public:
  void exchange(const IoOutputs& outputs, const IoPlace&, IoInputs& now) TRN_RT override {
    told = outputs;
    now = inputs;
  }
  IoOutputs told;
  IoInputs inputs;
};

QueueEvent event_of(Kind kind, double value = 0, std::int32_t argument = 0) {
  QueueEvent event;
  event.kind = kind;
  event.value = value;
  event.argument = argument;
  event.per_turn_mm = 1;
  return event;
}

QueueEvent wait_for(InputWait wait, double limit_s = 1, int input = 3, bool analog = false) {
  return event_of(Kind::kWaitInput, limit_s, InputArgument{input, wait, analog}.packed());
}

class TickIoTest : public testing::Test {
 protected:
  Fault exchange(double spindle_override = 1, bool drives_touch = false) {
    return io.exchange({q, offset}, spindle_override, drives_touch);
  }
  /// Periods that an event waits, with an exchange behind each; -1: it failed.
  int waits(const QueueEvent& event, int limit = 1000) {
    for (int i = 0; i <= limit; ++i) {
      const Outcome outcome = io.obey(event);
      exchange();
      if (outcome == Outcome::kFailed) return -1;
      if (outcome == Outcome::kDone) return i;
    }
    return limit + 1;
  }
  void input(bool on) {
    devices.inputs.digital = on ? 1u << 3 : 0;
    exchange();
  }
  JointVec q = JointVec::Zero(3);
  Vec3 offset = Vec3::Zero();
  Devices devices;
  TickIo io{&devices, kPeriod, 0.5};
};

TEST_F(TickIoTest, EventsReachTheDevicesInTheSamePeriod) {
  io.obey(event_of(Kind::kSpindle, -1200));
  io.obey(event_of(Kind::kCoolant, 0, 3));
  io.obey(event_of(Kind::kDigitalOutput, 1, 5));
  io.obey(event_of(Kind::kDigitalOutput, 1, 6));
  io.obey(event_of(Kind::kDigitalOutput, 0, 5));
  io.obey(event_of(Kind::kAnalogOutput, 2.5, 1));
  exchange(1.5);
  EXPECT_EQ(devices.told.spindle_rpm, -1800);
  EXPECT_EQ(devices.told.coolant, 3);
  EXPECT_EQ(devices.told.digital, 1u << 6);
  EXPECT_EQ(devices.told.analog[1], 2.5);
  EXPECT_EQ(io.outputs().spindle_rpm, -1200) << "the override is not kept";
  io.all_off();
  exchange();
  EXPECT_EQ(devices.told.spindle_rpm, 0);
  EXPECT_EQ(devices.told.digital, 0u);
  EXPECT_EQ(devices.told.coolant, 0);
}

TEST_F(TickIoTest, TheSpindleHasAPeriodToHearAndHalfASecondToComeToSpeed) {
  EXPECT_EQ(waits(event_of(Kind::kSpindle, 1000)), 1) << "what it said before it heard does not count";
  EXPECT_EQ(waits(event_of(Kind::kSpindle, 0)), 0) << "nobody waits for a stop";
  devices.inputs.spindle_ready = false;
  exchange();
  EXPECT_EQ(waits(event_of(Kind::kSpindle, 1000), 49), 50);
  EXPECT_EQ(io.obey(event_of(Kind::kSpindle, 1000)), Outcome::kFailed) << "more than 0.5 s";
  EXPECT_EQ(io.failure(), Fault::kSpindle);
}

TEST_F(TickIoTest, OrientingTurnsTheSpindleOff) {
  io.obey(event_of(Kind::kSpindle, 500));
  EXPECT_EQ(waits(event_of(Kind::kSpindleOrient, 90)), 0);
  EXPECT_TRUE(devices.told.spindle_orients);
  EXPECT_EQ(devices.told.spindle_deg, 90);
  EXPECT_EQ(devices.told.spindle_rpm, 0);
  waits(event_of(Kind::kSpindle, 500));
  EXPECT_FALSE(devices.told.spindle_orients);
}

TEST_F(TickIoTest, WaitsForLevelsAndEdges) {
  input(true);
  EXPECT_EQ(waits(wait_for(InputWait::kHigh)), 0);
  EXPECT_EQ(io.input_value(), 1);
  EXPECT_EQ(waits(wait_for(InputWait::kNow)), 0);
  input(false);
  EXPECT_EQ(waits(wait_for(InputWait::kLow)), 0);
  EXPECT_EQ(io.input_value(), 0);
  EXPECT_EQ(io.obey(wait_for(InputWait::kRise)), Outcome::kWaits);
  input(true);
  EXPECT_EQ(io.obey(wait_for(InputWait::kRise)), Outcome::kDone);
  EXPECT_EQ(io.obey(wait_for(InputWait::kFall)), Outcome::kWaits);
  EXPECT_EQ(io.obey(wait_for(InputWait::kFall)), Outcome::kWaits);
  input(false);
  EXPECT_EQ(io.obey(wait_for(InputWait::kFall)), Outcome::kDone);
}

TEST_F(TickIoTest, AnInputThatDoesNotComeInTimeIsMinusOne) {
  EXPECT_EQ(waits(wait_for(InputWait::kHigh, 0.2)), 20);
  EXPECT_EQ(io.input_value(), -1);
  devices.inputs.analog[3] = 4.25;
  exchange();
  EXPECT_EQ(waits(wait_for(InputWait::kNow, 0, 3, true)), 0);
  EXPECT_EQ(io.input_value(), 4.25);
}

// Whatever was waited for before, an input that is on already has not risen.
TEST_F(TickIoTest, EveryEventLooksForItself) {
  QueueEvent pass = event_of(Kind::kGearStart, 10, static_cast<std::int32_t>(GearMode::kSpindleLeads));
  QueueEvent tap = event_of(Kind::kGearStart, 10, static_cast<std::int32_t>(GearMode::kPathLeads));
  const QueueEvent before[] = {event_of(Kind::kSpindle, 100),   event_of(Kind::kSpindleOrient, 10),
                               wait_for(InputWait::kHigh, 0.1), wait_for(InputWait::kHigh, 0.1, 4),
                               event_of(Kind::kToolChange, 4),  pass,
                               event_of(Kind::kGearEnd),        tap,
                               event_of(Kind::kGearReverse),    event_of(Kind::kGearEnd)};
  int number = 0;
  for (const QueueEvent& event : before) {
    SCOPED_TRACE(number++);
    devices.inputs = {};
    exchange();
    io.obey(wait_for(InputWait::kLow));  // has seen that it is off
    for (int i = 0; i < 40 && io.obey(event) != Outcome::kDone; ++i) {
      devices.inputs.spindle_turns +=
          event.kind == Kind::kGearStart && event.argument == pass.argument ? 0.2 : 0;
      devices.inputs.digital = i == 2 ? 1u << 4 : 0;
      exchange();
    }
    input(true);
    EXPECT_EQ(io.obey(wait_for(InputWait::kRise)), Outcome::kWaits);
    input(false);
    io.obey(wait_for(InputWait::kRise));
    input(true);
    EXPECT_EQ(io.obey(wait_for(InputWait::kRise)), Outcome::kDone);
  }
}

TEST_F(TickIoTest, AToolIsInWhenItsInputRises) {
  EXPECT_EQ(io.obey(event_of(Kind::kToolChange, kToolByNobody)), Outcome::kDone);
  input(true);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(io.obey(event_of(Kind::kToolChange, 3)), Outcome::kWaits);
  input(false);
  EXPECT_EQ(io.obey(event_of(Kind::kToolChange, 3)), Outcome::kWaits);
  input(true);
  EXPECT_EQ(io.obey(event_of(Kind::kToolChange, 3)), Outcome::kDone);
}

TEST_F(TickIoTest, AThreadBeginsAtTheIndexPulse) {
  const QueueEvent start = event_of(Kind::kGearStart, 10, static_cast<std::int32_t>(GearMode::kSpindleLeads));
  devices.inputs.spindle_turns = 7.55;
  exchange();
  int i = 0;
  for (; i < 100 && io.obey(start) == Outcome::kWaits; ++i) {
    EXPECT_TRUE(io.reads_encoder());
    EXPECT_FALSE(io.geared());
    devices.inputs.spindle_turns += 0.1;
    exchange();
  }
  EXPECT_NEAR(devices.inputs.spindle_turns, 8.05, 1e-9);
  EXPECT_TRUE(io.geared());
  EXPECT_FALSE(io.taps());
  // 10 turns a second as planned, 0.05 turns late: 5 ms behind
  devices.inputs.spindle_turns += 0.1;
  exchange();
  EXPECT_NEAR(io.gear_rate(0, 0), 1 + 40 * 0.015, 1e-9);
  EXPECT_NEAR(io.gear_lag_s(), 0.015, 1e-12);
  EXPECT_EQ(io.obey(event_of(Kind::kGearEnd)), Outcome::kDone);
  EXPECT_FALSE(io.geared());
}

TEST_F(TickIoTest, ASpindleWithoutAnIndexPulseFails) {
  const QueueEvent start = event_of(Kind::kGearStart, 10, static_cast<std::int32_t>(GearMode::kSpindleLeads));
  EXPECT_EQ(waits(start), -1);
  EXPECT_EQ(io.failure(), Fault::kSpindle);
  EXPECT_FALSE(io.reads_encoder());
}

TEST_F(TickIoTest, TheProbeIsSeenByTheDevicesOrTheDrives) {
  EXPECT_FALSE(io.probe_found());
  io.obey(event_of(Kind::kProbeStart, 0, static_cast<std::int32_t>(ProbeMode::kContact)));
  EXPECT_FALSE(io.probe_found());
  exchange(1, true);
  EXPECT_TRUE(io.probe_found());
  exchange();
  EXPECT_FALSE(io.probe_found());
  devices.inputs.probe = true;
  exchange();
  EXPECT_TRUE(io.probe_found());
  EXPECT_EQ(io.end_probe(true), Outcome::kDone);
  EXPECT_FALSE(io.probe_found()) << "nobody looks for it";
  EXPECT_EQ(io.obey(event_of(Kind::kProbeStart, 0, static_cast<std::int32_t>(ProbeMode::kTryContact))),
            Outcome::kFailed)
      << "it touches already";
}

TEST_F(TickIoTest, AProbeMoveHasATenthOfASecondBehindItsEnd) {
  io.obey(event_of(Kind::kProbeStart, 0, static_cast<std::int32_t>(ProbeMode::kTryContact)));
  EXPECT_EQ(waits(event_of(Kind::kProbeEnd)), 10);
  io.obey(event_of(Kind::kProbeStart, 0, static_cast<std::int32_t>(ProbeMode::kContact)));
  EXPECT_EQ(waits(event_of(Kind::kProbeEnd)), -1);
  EXPECT_EQ(io.failure(), Fault::kProbe);
}

TEST_F(TickIoTest, TheEndOfAProgramSwitchesTheCoolantOffWhereItSaysSo) {
  io.obey(event_of(Kind::kCoolant, 0, 3));
  io.obey(event_of(Kind::kProgramEnd));
  exchange();
  EXPECT_EQ(devices.told.coolant, 3);
  io.obey(event_of(Kind::kProgramEnd, 0, 1));
  exchange();
  EXPECT_EQ(devices.told.coolant, 0);
}

TEST(TickIo, WithoutDevicesTheSpindleIsReadyAndInputsAreZero) {
  TickIo io(nullptr, kPeriod, 0.5);
  EXPECT_EQ(io.obey(event_of(Kind::kSpindle, 100)), Outcome::kDone);
  EXPECT_EQ(io.obey(wait_for(InputWait::kLow)), Outcome::kDone);
  const JointVec q = JointVec::Zero(3);
  const Vec3 offset = Vec3::Zero();
  EXPECT_EQ(io.exchange({q, offset}, 1, true), Fault::kOk);
  io.obey(event_of(Kind::kProbeStart, 0, static_cast<std::int32_t>(ProbeMode::kRelease)));
  EXPECT_FALSE(io.probe_found());
}

// G96: the speed follows the tip, in steps that a drive can tell apart; the greatest speed is that of the
// chuck, whatever the override.
TEST_F(TickIoTest, TheSpindleFollowsTheSurfaceSpeed) {
  QueueEvent event = event_of(Kind::kSpindle, -100);
  event.surface = {Vec3::UnitX(), 20, -3000, 400};
  EXPECT_EQ(waits(event), 1);
  const auto told_at = [&](double x, double spindle_override = 1) {
    io.follow_tip(Vec3(x, 7, 7));
    exchange(spindle_override);
    return devices.told.spindle_rpm;
  };
  EXPECT_DOUBLE_EQ(told_at(50), -100);
  EXPECT_DOUBLE_EQ(told_at(50.1), -100) << "a third of a percent";
  EXPECT_DOUBLE_EQ(told_at(50.2), -3000 / 30.2);
  EXPECT_DOUBLE_EQ(told_at(5), -200) << "on the other side";
  EXPECT_DOUBLE_EQ(told_at(20.5), -400) << "near the axis";
  EXPECT_DOUBLE_EQ(told_at(20), -400);
  EXPECT_DOUBLE_EQ(told_at(20, 1.5), -400);
  EXPECT_DOUBLE_EQ(told_at(50, 1.5), -150);
  EXPECT_DOUBLE_EQ(io.told_rpm(0.5), -50);
  EXPECT_EQ(waits(event_of(Kind::kSpindle, 500)), 1);
  EXPECT_DOUBLE_EQ(told_at(30), 500) << "G97";
  EXPECT_EQ(waits(event), 1);
  io.all_off();
  EXPECT_DOUBLE_EQ(told_at(30), 0);
}

}  // namespace
}  // namespace trn
