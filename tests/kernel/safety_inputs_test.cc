#include "kernel/safety_inputs.h"

#include <gtest/gtest.h>

#include <vector>

namespace trn {
namespace {

SafetyInputs::Input input(SafetyKind kind, int number) {
  SafetyInputs::Input out;
  out.kind = kind;
  out.from = {SignalName::Kind::kIoInput, -1, number};
  return out;
}
Feedback drives(DriveState state) {
  Feedback out;
  out.state = state;
  return out;
}
constexpr SafetyInputs::Motion kStands{}, kMoves{true, false, false}, kJogs{true, true, false},
    kTurns{false, false, true};

TEST(SafetyInputs, EachKindHasAFaultOfItsOwn) {
  EXPECT_EQ(SafetyInputs::fault_of(SafetyKind::kEmergencyStop), Fault::kEmergencyInput);
  EXPECT_EQ(SafetyInputs::fault_of(SafetyKind::kEnable), Fault::kEnableOff);
  EXPECT_EQ(SafetyInputs::fault_of(SafetyKind::kDoor), Fault::kDoorOpen);
  EXPECT_EQ(SafetyInputs::fault_of(SafetyKind::kAir), Fault::kAirPressure);
}

TEST(SafetyInputs, EmergencyStopIsWatchedWhileDrivesAreOn) {
  SafetyInputs safety({input(SafetyKind::kEmergencyStop, 3)});
  EXPECT_EQ(safety.step(8, drives(DriveState::kEnabled), kStands), Fault::kOk);
  EXPECT_EQ(safety.step(0, drives(DriveState::kOff), kStands), Fault::kOk);
  EXPECT_EQ(safety.step(0, drives(DriveState::kStarting), kStands), Fault::kEmergencyInput);
  EXPECT_EQ(safety.step(8, drives(DriveState::kStarting), kStands), Fault::kOk);
}

TEST(SafetyInputs, ADoorStopsWhatMovesAndMayLetTheOperatorJog) {
  for (const bool jog : {false, true}) {
    SafetyInputs::Input door = input(SafetyKind::kDoor, 0);
    door.stops_jogs = !jog;
    SafetyInputs safety({door});
    EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kStands), Fault::kOk);
    EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kMoves), Fault::kDoorOpen);
    EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kTurns), Fault::kDoorOpen);
    EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kJogs), jog ? Fault::kOk : Fault::kDoorOpen);
  }
}

TEST(SafetyInputs, OneThatBouncesIsNoFault) {
  SafetyInputs::Input air = input(SafetyKind::kAir, 0);
  air.debounce_periods = 3;
  SafetyInputs safety({air});
  for (int i = 0; i < 30; ++i)
    EXPECT_EQ(safety.step(i % 4 == 0, drives(DriveState::kEnabled), kMoves), Fault::kOk) << i;
  // It has been away for one period already.
  for (int i = 0; i < 2; ++i) EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kMoves), Fault::kOk);
  EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kMoves), Fault::kAirPressure);
}

TEST(SafetyInputs, MayBeOnWhenSomethingIsWrong) {
  SafetyInputs::Input air = input(SafetyKind::kAir, 63);
  air.safe_when_on = false;
  SafetyInputs safety({air});
  EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kMoves), Fault::kOk);
  EXPECT_EQ(safety.step(std::uint64_t{1} << 63, drives(DriveState::kEnabled), kMoves), Fault::kAirPressure);
}

TEST(SafetyInputs, TheStrongestReactionIsTold) {
  SafetyInputs safety({input(SafetyKind::kDoor, 0), input(SafetyKind::kEmergencyStop, 1)});
  EXPECT_EQ(safety.step(0, drives(DriveState::kEnabled), kMoves), Fault::kEmergencyInput);
}

TEST(SafetyInputs, AreHeardOfDrivesToo) {
  SafetyInputs::Input stop = input(SafetyKind::kEmergencyStop, 16);
  stop.from = {SignalName::Kind::kDriveInput, 2, 16};
  SafetyInputs safety({stop});
  Feedback feedback = drives(DriveState::kEnabled);
  EXPECT_EQ(safety.step(0, feedback, kStands), Fault::kOk) << "the drive has not told them yet";
  feedback.inputs_heard_mask = 4;
  feedback.inputs[2] = 1u << 16;
  EXPECT_EQ(safety.step(0, feedback, kStands), Fault::kOk);
  feedback.inputs[2] = 1u << 15;
  EXPECT_EQ(safety.step(~0ull, feedback, kStands), Fault::kEmergencyInput);
}

}  // namespace
}  // namespace trn
