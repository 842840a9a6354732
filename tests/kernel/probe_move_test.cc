#include "kernel/probe_move.h"

#include <gtest/gtest.h>

#include "hal/loopback.h"

namespace trn {
namespace {

JointVec joints_at(double x, double y) {
  JointVec q(2);
  q << x, y;
  return q;
}

/// Drives with a touch probe on their own inputs; each test says what they answer.
class TouchingDrives final : public Drives, public TouchDrives {
 public:
  void bring_up() override {}
  void shut_down() noexcept override {}
  void reset_faults() override {}
  void exchange(const Setpoints&, Feedback&) TRN_RT override {}
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override {}
  int touch_periods() const TRN_RT override { return periods; }
  void arm_touch(bool at_contact) TRN_RT override {
    ++armed;
    contact = at_contact;
  }
  void disarm_touch() TRN_RT override { ++disarmed; }
  const TouchProbe& touch() const TRN_RT override { return answer; }

  int periods = 3, armed = 0, disarmed = 0;
  bool contact = false;
  TouchProbe answer;
};

using Wait = ProbeMove::Wait;

TEST(ProbeMove, WithoutAProbeOnTheDrivesNothingIsWaitedFor) {
  LoopbackDrives drives(joints_at(0, 0));
  ProbeMove probe(drives, 2);
  EXPECT_EQ(probe.arm(ProbeMode::kContact), Wait::kOver);
  EXPECT_FALSE(probe.touched());
  probe.touch(joints_at(1, 2));
  probe.touch(joints_at(3, 4));
  EXPECT_TRUE(probe.touched());
  EXPECT_EQ(probe.take_latched(), Wait::kOver);
  EXPECT_EQ(probe.q_contact(), joints_at(1, 2)) << "the first contact counts";
  probe.reset();
  EXPECT_FALSE(probe.touched());
}

TEST(ProbeMove, DrivesAreArmedOnceAndHaveAlwaysTheSameTime) {
  TouchingDrives drives;
  ProbeMove probe(drives, 2);
  drives.answer.armed = true;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(probe.arm(ProbeMode::kRelease), Wait::kGoesOn);
  EXPECT_EQ(probe.arm(ProbeMode::kRelease), Wait::kOver);
  EXPECT_EQ(drives.armed, 1);
  EXPECT_FALSE(drives.contact) << "G38.4 looks for the loss of contact";
}

TEST(ProbeMove, DrivesThatDoNotArmAreAFailure) {
  TouchingDrives drives;
  ProbeMove probe(drives, 2);
  drives.answer.armed = false;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(probe.arm(ProbeMode::kContact), Wait::kGoesOn);
  EXPECT_EQ(probe.arm(ProbeMode::kContact), Wait::kFailed);
  EXPECT_EQ(drives.armed, 1);
  EXPECT_TRUE(drives.contact);
}

TEST(ProbeMove, WhatTheDrivesLatchedIsBetterThanWhatWasMeasured) {
  TouchingDrives drives;
  ProbeMove probe(drives, 2);
  drives.answer.q = joints_at(1.25, 2.5);
  drives.answer.latched_mask = 0b11;
  probe.touch(joints_at(1, 2));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(probe.take_latched(), Wait::kGoesOn);
  EXPECT_EQ(probe.take_latched(), Wait::kOver);
  EXPECT_EQ(probe.q_contact(), joints_at(1.25, 2.5));
  EXPECT_EQ(drives.disarmed, 1);
  EXPECT_EQ(probe.take_latched(), Wait::kOver) << "the rest of the move may take more periods";
  EXPECT_EQ(drives.disarmed, 1);
}

TEST(ProbeMove, OneDriveThatLatchedNothingIsAFailure) {
  TouchingDrives drives;
  ProbeMove probe(drives, 2);
  drives.answer.latched_mask = 0b01;
  probe.touch(joints_at(1, 2));
  Wait last = Wait::kGoesOn;
  while (last == Wait::kGoesOn) last = probe.take_latched();
  EXPECT_EQ(last, Wait::kFailed);
  EXPECT_EQ(drives.disarmed, 1);
}

TEST(ProbeMove, DrivesWithoutPeriodsForItHaveNoProbe) {
  TouchingDrives drives;
  drives.periods = 0;
  drives.answer.contact = true;
  ProbeMove probe(drives, 2);
  EXPECT_FALSE(probe.drives_see_contact());
  EXPECT_EQ(probe.arm(ProbeMode::kContact), Wait::kOver);
  EXPECT_EQ(drives.armed, 0);
}

}  // namespace
}  // namespace trn
