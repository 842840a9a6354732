#include "hal/can/setup_steps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "hal/can/sdo.h"
#include "tests/support/eds_sheet.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

using Kind = SetupStep::Kind;

ObjectDictionary servo() { return load_eds(source_dir() + "/configs/eds/servo.eds", 3); }

DriveSetup plain(Cia402Mode mode = Cia402Mode::kCyclicPosition) {
  DriveSetup setup;
  setup.period_s = 0.002;
  setup.mode = mode;
  setup.heartbeat_ms = 50;
  setup.heartbeat_timeout_ms = 150;
  return setup;
}

int count(const std::vector<SetupStep>& steps, ObjectKey key) {
  int found = 0;
  for (const SetupStep& step : steps) found += step.key == key;
  return found;
}

// CiA 402-2, 12.4.4: the period is 0x60C2:1 (unsigned, 8 bits) times ten to the power of 0x60C2:2 (signed)
// seconds.
TEST(SetupSteps, TheInterpolationTimeIsExact) {
  for (const double period_s : {0.0001, 0.000125, 0.00025, 0.000255, 0.001, 0.002, 0.004, 0.01, 0.255, 1.0}) {
    const auto time = interpolation_time(period_s, servo());
    ASSERT_TRUE(time) << period_s;
    EXPECT_NEAR(time->value * std::pow(10.0, time->exponent), period_s, 1e-12);
  }
}

TEST(SetupSteps, TheInterpolationTimeIsInMillisecondsIfItCanBe) {
  const auto form = [](double period_s, const std::string& limits = "", const std::string& exponents = "") {
    const std::string text = sheet_text({"60C2"}, "[60C2]\nParameterName=Time\nObjectType=0x9\n" +
                                                      variable("60C2sub1", "5", "rw", "1", limits) +
                                                      variable("60C2sub2", "2", "rw", "-3", exponents));
    const auto time = interpolation_time(period_s, parse_eds(text, "x.eds", 1));
    return time ? std::vector<int>{time->value, time->exponent} : std::vector<int>{};
  };
  EXPECT_EQ(form(0.01), (std::vector<int>{10, -3}));
  EXPECT_EQ(form(0.002), (std::vector<int>{2, -3}));
  EXPECT_EQ(form(0.1), (std::vector<int>{100, -3}));
  EXPECT_EQ(form(0.00025), (std::vector<int>{25, -5}));
  EXPECT_EQ(form(0.01, "HighLimit=5\n"), (std::vector<int>{1, -2}));
  EXPECT_EQ(form(0.002, "", "HighLimit=-4\n"), (std::vector<int>{20, -4})) << "no milliseconds";
  EXPECT_EQ(form(0.002, "LowLimit=1\nHighLimit=1\n"), (std::vector<int>{})) << "1 ms and nothing else";
  EXPECT_EQ(form(0.0001234), (std::vector<int>{})) << "more digits than eight bits hold";
}

TEST(SetupSteps, NothingOfAnotherModeIsWritten) {
  for (const Cia402Mode mode : {Cia402Mode::kCyclicPosition, Cia402Mode::kCyclicVelocity,
                                Cia402Mode::kInterpolatedPosition, Cia402Mode::kProfilePosition}) {
    DriveSetup setup = plain(mode);
    const bool profile = mode == Cia402Mode::kProfilePosition;
    const auto steps = setup_steps(setup, servo(), {}, {});
    for (const ObjectKey key : {ObjectKey{0x6081, 0}, ObjectKey{0x6083, 0}, ObjectKey{0x6084, 0}})
      EXPECT_EQ(count(steps, key), profile ? 1 : 0) << to_string(key) << " in mode " << to_string(mode);
    EXPECT_EQ(count(steps, {0x6085, 0}), 1) << "a quick stop is of every mode";
    EXPECT_EQ(count(steps, {0x6098, 0}), 1);
    setup.homes = false;
    EXPECT_EQ(count(setup_steps(setup, servo(), {}, {}), {0x6098, 0}), 0);
  }
}

TEST(SetupSteps, HeartbeatsAndGuardingAreOfObjectsThatThereAre) {
  EXPECT_EQ(count(setup_steps(plain(), servo(), {}, {}), {0x1016, 1}), 1);
  const ObjectDictionary deaf = parse_eds(sheet_text({"1016"}), "deaf.eds", 3);
  DriveSetup setup = plain();
  EXPECT_EQ(count(setup_steps(setup, deaf, {}, {}), {0x1016, 1}), 0);
  EXPECT_EQ(count(setup_steps(setup, deaf, {}, {}), {0x100C, 0}), 0);
  setup.heartbeat_ms = 0;
  setup.guard_ms = 40;
  setup.life_time_factor = 3;
  const auto steps = setup_steps(setup, deaf, {}, {});
  EXPECT_EQ(count(steps, {0x100C, 0}), 1);
  EXPECT_EQ(count(steps, {0x100D, 0}), 1);
  for (const SetupStep& step : steps)
    if (step.key == ObjectKey{0x1017, 0}) {
      EXPECT_EQ(step.bytes, (std::vector<std::uint8_t>{0, 0})) << "never both at once";
    }
}

// A PDO that is on keeps its identifier while it is switched off (CiA 301, 7.5.2.35): the bit is set in what
// the drive has there. Bit 30 is the data sheet's.
TEST(SetupSteps, PdosAreSwitchedOffByTheirBit) {
  const std::string text = sheet_text(
      {"1801", "1804"},
      "[1801]\nParameterName=TPDO 2\nObjectType=0x9\n" +
          variable("1801sub1", "7", "rw", "$NODEID+0x40000280") +
          "[1804]\nParameterName=TPDO 5\nObjectType=0x9\n" + variable("1804sub1", "7", "rw", "0x1F3") +
          "[1805]\nParameterName=TPDO 6\nObjectType=0x9\n" + variable("1805sub1", "7", "rw", "0x80000000"));
  Pdo first, second;
  first.id = 0x183;
  second.id = 0x283;
  second.number = 1;
  const auto steps = setup_steps(plain(), parse_eds(text, "x.eds", 3), {}, {first, second});
  int on = 0, off = 0;
  for (const SetupStep& step : steps) {
    if (step.key.sub != 1 || step.key.index < 0x1400 || step.key.index > 0x18FF || step.key.index == 0x1A00)
      continue;
    if (step.key.index >= 0x1600 && step.key.index < 0x1800) continue;
    const std::uint64_t value = get_le(step.bytes.data(), 4);
    if (step.kind == Kind::kSetBits) {
      ++off;
      EXPECT_EQ(value, 0x80000000u) << to_string(step.key);
      EXPECT_NE(step.key.index, 0x1805) << "is off by itself";
    } else {
      ++on;
      EXPECT_EQ(value, step.key.index == 0x1800 ? 0x183u : 0x40000283u) << to_string(step.key);
    }
  }
  EXPECT_EQ(on, 2);
  EXPECT_EQ(off, 4 + 4 + 1) << "four RPDOs, four TPDOs, and the fifth that the data sheet has on";
}

TEST(SetupSteps, WhatIsSkippedIsNotWrittenAndStillChecked) {
  DriveSetup setup = plain();
  setup.interpolation = InterpolationTime{2, -3};
  setup.skip = {"0x6085", "0x60C2:2", "0x1000"};
  const auto steps = setup_steps(setup, servo(), {}, {});
  EXPECT_EQ(count(steps, {0x6085, 0}), 0);
  EXPECT_EQ(count(steps, {0x60C2, 1}), 1);
  EXPECT_EQ(count(steps, {0x60C2, 2}), 0);
  EXPECT_EQ(count(steps, {0x1000, 0}), 1);
}

TEST(SetupSteps, TheSignatureIsWhatTheDriveDoesNotHoldAtPowerOn) {
  const auto signature = [](const ObjectDictionary& eds, const DriveSetup& setup) {
    return signature_step(setup_steps(setup, eds, {}, {}), eds);
  };
  EXPECT_EQ(signature(servo(), plain()).key, (ObjectKey{0x1016, 1}));
  EXPECT_EQ(signature(servo(), plain()).bytes, (std::vector<std::uint8_t>{150, 0, 127, 0}));
  const ObjectDictionary deaf = parse_eds(sheet_text({"1016"}), "deaf.eds", 3);
  EXPECT_EQ(signature(deaf, plain()).key, (ObjectKey{0x1006, 0})) << "0 by the data sheet";
  DriveSetup guarded = plain();
  guarded.guard_ms = 40;
  guarded.life_time_factor = 3;
  EXPECT_EQ(signature(deaf, guarded).key, (ObjectKey{0x100C, 0}));
  const ObjectDictionary bare = parse_eds(sheet_text({"1016", "1006"}), "bare.eds", 3);
  EXPECT_EQ(signature(bare, plain()).key, (ObjectKey{0x1000, 0}));
  EXPECT_TRUE(signature(bare, plain()).bytes.empty()) << "which no answer equals";
  Pdo setpoints;
  setpoints.id = 0x203;
  setpoints.transmission = 7;
  const ObjectKey key = signature_step(setup_steps(plain(), bare, {setpoints}, {}), bare).key;
  EXPECT_EQ(key, (ObjectKey{0x1400, 2})) << "its transmission type";
}

TEST(SetupSteps, RampsStayWithinTheDataSheetsLimits) {
  DriveSetup setup = plain();
  setup.quick_stop = 4'000'000'000;
  const std::string text = sheet_text({"6085"}, variable("6085", "7", "rw", "100", "HighLimit=50000\n"));
  for (const SetupStep& step : setup_steps(setup, parse_eds(text, "x.eds", 3), {}, {}))
    if (step.key == ObjectKey{0x6085, 0}) {
      EXPECT_EQ(get_le(step.bytes.data(), 4), 50000u);
    }
}

}  // namespace
}  // namespace trn
